"""Faults put into a real unit at random places and of random sizes: which of them the print check finds.

    python -m benchmarks.print_faults [--seed 1] [--each 4] [kind ...]

The unit has three chambers. A fault is found if the check names it and, where it lies at one place, within
2 mm of it.
"""

from __future__ import annotations

import numpy as np

from benchmarks.table import circumstances, options_of
from mu_addon.design import shapes
from mu_addon.design.lattice import lattice_of
from mu_addon.design.printing.check import check
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.solid import printable
from tests.design.printing import parts

NEAR_MM = 2.0


def _patch(random):
    """Some faces that lie together, and where."""
    solid = parts.small_solid()
    place = solid.vertices[solid.triangles[random.integers(len(solid.triangles))]].mean(axis=0)
    chosen = parts.near(solid.vertices, solid.triangles, place, random.uniform(0.4, 1.5))
    return solid.vertices, solid.triangles, place, chosen


def flipped(random):
    vertices, triangles, place, chosen = _patch(random)
    return (vertices, np.where(chosen[:, None], triangles[:, ::-1], triangles)), "flipped faces", place, ()


def doubled(random):
    vertices, triangles, place, chosen = _patch(random)
    return (vertices, np.concatenate([triangles, triangles[chosen]])), "doubled faces", place, ()


def missing(random):
    vertices, triangles, place, chosen = _patch(random)
    return (vertices, triangles[~chosen]), "open edges", place, ()


def floating(random):
    """A rod in the air, near the middle of a window of the lattice's."""
    middle = np.array([12.5, 6.25, 18.75]) + random.uniform(-0.6, 0.6, 3)
    return parts.with_floating_strut(middle), "loose pieces", middle, ()


def missing_strut(random):
    lattice = lattice_of(parts.small_unit().dimensions)
    middles = lattice.nodes[lattice.struts].mean(axis=1)
    # Far from the membrane, where a strut is all that the cut meets.
    far = middles[np.hypot(middles[:, 0], middles[:, 1]) > 18.0]
    place = far[random.integers(len(far))]
    body = parts.small_body() - shapes.box(place - 1.6, place + 1.6)
    return printable(body), "tunnels", None, ()


def hole(random):
    return parts.drilled(random.uniform(0.1, 0.8)), "leak test", parts.APEX, ("chambers",)


def thin_wall(random):
    return parts.thin_walled(random.uniform(0.1, 0.3)), "chamber wall", parts.APEX, ("thickness", "chambers")


def narrow_drain(random):
    return parts.narrowed(random.uniform(0.5, 1.8)), "drain", np.array([0.0, 0.0, -3.0]), ("chambers",)


def inches(random):
    solid = parts.small_solid()
    factor = random.choice([25.4, 1 / 25.4, 10.0, 0.1])
    return (factor * solid.vertices, solid.triangles), "scale", None, ()


def inside_out(random):
    solid = parts.small_solid()
    turned = np.roll(solid.vertices, random.integers(3), axis=1)
    return (turned, solid.triangles[:, ::-1]), "inside out", None, ()


KINDS = {
    kind.__name__: kind
    for kind in (
        flipped, doubled, missing, floating, missing_strut, inches, inside_out, hole, thin_wall, narrow_drain,
    )
}  # fmt: skip


def examined(kind, seed):
    """Whether a seeded fault was found, and what was found."""
    surface, name, place, stages = KINDS[kind](np.random.default_rng([seed, list(KINDS).index(kind)]))
    solid = parts.small_solid()
    nominal = (solid.vertices, solid.triangles) if kind == "missing_strut" else None
    unit = parts.small_unit() if stages or kind == "inches" else None
    found = check(*surface, load_printer(), unit, stages=stages, nominal=nominal)
    faults = {f.check: f for f in found.findings if f.is_fault}
    if name not in faults:
        return False, sorted(faults)
    places = faults[name].places
    near = place is None or np.linalg.norm(np.asarray(places) - place, axis=1).min() < NEAR_MM
    return bool(near), sorted(faults)


def main():
    parser = options_of(__doc__)
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], help=", ".join(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=4)
    given = parser.parse_args()
    print(circumstances())
    for kind in given.kinds or KINDS:
        made = [examined(kind, 1000 * given.seed + k) for k in range(given.each)]
        missed = [names for found, names in made if not found]
        print(f"{kind}: {len(made) - len(missed)} of {len(made)} found", *missed, flush=True)


if __name__ == "__main__":
    main()
