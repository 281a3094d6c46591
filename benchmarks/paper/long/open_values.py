"""What the paper does not print and what decides its table: ranges, points in them, what each gives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points
from mu_addon.design.parameters import Unit
from mu_addon.errors import ConvergenceError, MuError
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import Mesh
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.cache import Cache, key
from mu_addon.usecases.parameter_study.variable import Variable

from ..table.table_column import ENDS_KPA, Paths, motion, paths, with_fixed_base
from ..table.values import RULE, unit_of_table_column, with_values

Array = np.ndarray[Any, Any]


@attrs.frozen
class OpenValue:
    """An input that the paper leaves open, and why its range is believed."""

    variable: Variable
    why: str

    @property
    def name(self) -> str:
        """As unit.toml has it."""
        return self.variable.name


def _range(name: str, low: float, high: float, why: str, log: bool = False) -> OpenValue:
    return OpenValue(Variable(name, low, high, log=log), why)


# Beyond these, units snap between -20 and 40 kPa: tip caps below 3.4 mm, necks above 15 mm and the
# thinnest of the softest walls have limit points there. The paper's units move smoothly.
OPEN = (
    _range("chambers.wall_mm", 0.7, 1.2, "thinner ones snap; thicker ones are no membrane"),
    _range("chambers.neck_diameter_mm", 10.0, 15.0, "below, the inlet fills it; above, it balloons"),
    _range("chambers.bladder_share", 0.45, 0.7, "bladders and necks of like length"),
    _range("chambers.base_cap_mm", 1.0, 5.0, "from a wall's thickness to most of a half chamber"),
    _range("chambers.tip_cap_mm", 3.5, 5.5, "thinner ones snap; thicker ones fill the last chamber"),
    _range("material.membrane_modulus_kPa", 1700.0, 3000.0, "published, and slow loading", log=True),
    _range("material.sensor_modulus_kPa", 1000.0, 5000.0, "bulk-like, within a factor of two", log=True),
    _range("material.lattice_poisson", 0.0, 0.45, "from struts that bend to solids"),
)


@attrs.frozen
class Beside:
    """A set told beside the design, of what no range joins: values, and how the base is held.

    held_cells: height from the base, in cells, up to which the unit is held fast; 0 for the base alone.
    """

    name: str
    values: Mapping[str, Any] = attrs.field(factory=dict)
    held_cells: float = 0.0


# The paper prints neither its envelope, nor its anchors' row, nor how the unit is held.
BESIDE = (
    Beside("3 x 4 cells, row 2"),
    Beside("3 x 5 cells, row 2", {"lattice.cells_y_plus": 3}),
    Beside("3 x 5 cells, row 3", {"lattice.cells_y_plus": 3, "waveguide.row": 3}),
    Beside("5 x 4 cells, row 2", {"lattice.cells_x": 5}),
    Beside("held up to half a cell", held_cells=0.5),
    Beside("held up to one cell", held_cells=1.0),
    Beside("held up to one and a half cells", held_cells=1.5),
)
# Pressures in kPa of Model A: the protocol's ends, and that of the paper's range of bending.
MOTION_KPA = (*ENDS_KPA, 50.0)


@attrs.frozen(eq=False)
class PointResult:
    """What one set of values gives in each column (c).

    angle_deg (c, 3) at MOTION_KPA, nan beyond a limit point; crossing_kPa (c, 2), the first vacuum and the
    first pressure at which walls pass through each other, nan where none do; anchors at rest, one (p, 3) a
    column, in mm; paths at ENDS_KPA.
    """

    scales: tuple[float, ...]
    angle_deg: Array
    crossing_kPa: Array
    anchors: tuple[Array, ...]
    paths: tuple[Paths, ...]

    def J_hat(self, samples_kPa: Array) -> Array:
        """J_hat (c, paths) in mm over a protocol's samples (k,) in kPa."""
        found = zip(self.paths, self.anchors, strict=True)
        return np.array([p.J_hat(RULE, at_rest, samples_kPa) for p, at_rest in found])


def scaled(mesh: Mesh, factor: float) -> Mesh:
    """The mesh of the same unit at another scale: the mesher gives every scale the same elements."""
    return attrs.evolve(mesh, nodes=mesh.nodes * factor)


def design(count: int, seed: int = 1) -> list[dict[str, float]]:
    """The first points of a scrambled Sobol sequence in the open ranges; further ones leave them as they are.

    Source: Owen's scrambling, as in scipy.stats.qmc.
    """
    from scipy.stats import qmc

    # Sobol sequences are made by powers of two.
    whole = max(count - 1, 0).bit_length()
    places = qmc.Sobol(len(OPEN), scramble=True, seed=seed).random_base2(whole)[:count]
    return [{o.name: o.variable.at(float(u)) for o, u in zip(OPEN, row, strict=True)} for row in places]


def solve(
    unit: Unit,
    values: Mapping[str, Any],
    moduli_kPa: Mapping[float, float],
    mesh: MeshSettings,
    held_cells: float = 0.0,
) -> PointResult:
    """Every column with one set of values. Raises InputError, MeshingError and ConvergenceError."""
    same = with_values(attrs.evolve(unit, scale=1.0), values)
    body = with_fixed_base(mesh_unit(same, mesh), held_cells * same.dimensions.cell)
    angles, crossings, at_rest, found = [], [], [], []
    for scale, modulus in moduli_kPa.items():
        one = unit_of_table_column(same, scale, modulus)
        mine = scaled(body, scale)
        try:
            moved = motion(one, mine, MOTION_KPA)
        except ConvergenceError:
            # What fails may lie beyond the protocol, whose paths are wanted all the same.
            moved = motion(one, mine, ENDS_KPA)
        angles.append([moved.angle_at(p) if p in moved.pressure_kPa else np.nan for p in MOTION_KPA])
        sides = [[p for p in moved.crossing_kPa if p * sign > 0] for sign in (-1, 1)]
        crossings.append([min(side, key=abs) if side else np.nan for side in sides])
        at_rest.append(anchor_points(one))
        found.append(paths(one, mine, moved, (RULE,), ENDS_KPA))
    return PointResult(tuple(moduli_kPa), np.array(angles), np.array(crossings), tuple(at_rest), tuple(found))


def kept(
    cache: Cache,
    unit: Unit,
    values: Mapping[str, Any],
    moduli_kPa: Mapping[float, float],
    mesh: MeshSettings,
    held_cells: float = 0.0,
) -> PointResult | str:
    """`solve` from the cache, or solved and put there; a failure is kept as its reason."""
    figures = sorted(values.items()), sorted(moduli_kPa.items()), held_cells
    name = key(unit.hash(), figures, attrs.astuple(mesh), MOTION_KPA)
    stored = cache.get("open", name)
    if stored is not None:
        return str(stored["failed"]) if "failed" in stored else _unpacked(stored)
    try:
        console_summary = solve(unit, values, moduli_kPa, mesh, held_cells)
    except MuError as error:
        reason = f"{error.what} ({error.where})" if error.where else error.what
        cache.put("open", name, {"failed": np.array(reason)})
        return reason
    cache.put("open", name, _packed(console_summary))
    return console_summary


def _packed(console_summary: PointResult) -> dict[str, Array]:
    found = {
        "scales": np.array(console_summary.scales),
        "angle_deg": console_summary.angle_deg,
        "crossing_kPa": console_summary.crossing_kPa,
    }
    for i, (at_rest, p) in enumerate(zip(console_summary.anchors, console_summary.paths, strict=True)):
        found |= {f"anchors{i}": at_rest, f"rules{i}": np.array(p.rules)}
        found |= {f"{n}{i}": getattr(p, n) for n in ("pressure_kPa", "still", "apart", "volume_ratio")}
    return found


def _unpacked(stored: Mapping[str, Array]) -> PointResult:
    numbers = range(len(stored["scales"]))
    found = [
        Paths(
            tuple(str(r) for r in stored[f"rules{i}"]),
            *(stored[f"{n}{i}"] for n in ("pressure_kPa", "still", "apart", "volume_ratio")),
        )
        for i in numbers
    ]
    return PointResult(
        tuple(float(s) for s in stored["scales"]),
        stored["angle_deg"],
        stored["crossing_kPa"],
        tuple(stored[f"anchors{i}"] for i in numbers),
        tuple(found),
    )
