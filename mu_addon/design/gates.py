"""Geometry checks (gates) of a printable solid: required numbers before it is written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs

from ..errors import MuError
from .surface import Triangles, Vertices, area, bad_edges, genus, stl_bytes, stl_surface, volume

CAVITY_TOLERANCE = 0.01
"""Relative difference allowed between the cavity found in the solid and its analytic volume."""

STRAYED_MM3 = 1e-6
"""Volume that the waveguide's cuts may take from anything else: an allowance for roundoff."""


class GateError(MuError):
    """A solid that failed a geometry check and must not be printed; the message names the check."""

    status = 6


@attrs.frozen
class Guide:
    """Measurements on the lattice with its waveguide, next to the values they must have; mm3 and counts.

    cut_mm3: volume that wells, pockets and notches remove; strayed_mm3: the part of it removed from struts or
    membrane instead of the waveguide.
    """

    genus: int
    genus_expected: int
    components: int
    cut_mm3: float
    strayed_mm3: float


@attrs.frozen
class Gates:
    """Measurements on a printable solid, next to the values they must have; mm2, mm3 and counts.

    inner_shells and inner_volume_mm3 are those of the cavity, with the inlet plugged; guide: those of the
    waveguide, None without one.
    """

    lattice_genus: int
    lattice_genus_expected: int
    lattice_components: int
    components: int
    bad_edges: int
    bad_edges_after_stl: int
    inner_shells: int
    inner_volume_mm3: float
    inner_volume_expected_mm3: float
    genus: int
    volume_mm3: float
    area_mm2: float
    vertices: int
    triangles: int
    guide: Guide | None = None

    @property
    def inner_volume_error(self) -> float:
        """Relative difference of the measured cavity volume from the analytic one; 0 where they agree."""
        return self.inner_volume_mm3 / self.inner_volume_expected_mm3 - 1.0


def check_solid(
    vertices: Vertices,
    triangles: Triangles,
    plug: Any,
    sealed_volume: float,
    lattice: tuple[int, int],
    lattice_cycles: int,
    guide: Guide | None = None,
) -> Gates:
    """Measure a surface of vertices (n, 3) in mm and triangles (m, 3), and require every gate.

    plug: a Manifold that closes the inlet; sealed_volume: analytic volume in mm3 that it then encloses.
    lattice: genus and number of components of the bare lattice's solid; lattice_cycles: E - V + 1 of its
    graph. guide: the result of `check_waveguide`, if there is a waveguide. Raises GateError for the first
    gate that fails.
    """
    import manifold3d

    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices, triangles.astype("uint64")))
    sound = solid.status() == manifold3d.Error.NoError
    require((sound, "closed surface", f"the surface is not a manifold: {solid.status().name}"))
    inner = [shell.volume() for shell in (solid + plug).decompose() if shell.volume() < 0.0]
    reread = stl_surface(stl_bytes(vertices, triangles))[1]
    gates = Gates(
        lattice_genus=lattice[0],
        lattice_genus_expected=lattice_cycles,
        lattice_components=lattice[1],
        components=len(solid.decompose()),
        bad_edges=bad_edges(triangles),
        bad_edges_after_stl=bad_edges(reread),
        inner_shells=len(inner),
        inner_volume_mm3=-sum(inner),
        inner_volume_expected_mm3=sealed_volume,
        genus=genus(vertices, triangles),
        volume_mm3=volume(vertices, triangles),
        area_mm2=area(vertices, triangles),
        vertices=len(vertices),
        triangles=len(triangles),
        guide=guide,
    )
    require_solid(gates)
    return gates


def check_waveguide(sensed: Any, bar: Any, cuts: Any, actuator: Sequence[Any], cycles: int) -> Guide:
    """Measure the lattice united with its waveguide, and the volume of the cuts; bodies are Manifolds in mm.

    sensed: lattice and waveguide; bar: the waveguide alone; cuts: its wells, pockets and notches; actuator:
    its bodies; cycles: E - V + 1 of the lattice's graph with the waveguide's edges. Raises GateError where
    the cuts touch struts or membrane, or the result is in pieces or has another genus than `cycles`.
    """
    from manifold3d import Manifold, OpType

    cut = sensed - cuts
    taken = float(sensed.volume() - cut.volume())
    membrane = float((Manifold.batch_boolean(list(actuator), OpType.Add) ^ cuts).volume())
    guide = Guide(
        genus=cut.genus(),
        genus_expected=cycles,
        components=len(cut.decompose()),
        cut_mm3=taken,
        strayed_mm3=taken - float((bar ^ cuts).volume()) + membrane,
    )
    genus, wanted = guide.genus, guide.genus_expected
    require(
        (
            guide.strayed_mm3 <= STRAYED_MM3,
            "cuts clear of struts and membrane",
            f"wells or pockets of the waveguide take {guide.strayed_mm3:.3g} mm3 from struts or membrane",
        ),
        (
            guide.components == 1,
            "waveguide in one piece",
            f"lattice and waveguide fall into {guide.components} pieces",
        ),
        (
            genus == wanted,
            "waveguide genus",
            f"the lattice with its waveguide has genus {genus}, its graph {wanted}: a well or a seat makes a "
            "tunnel or closes one",
        ),
    )
    return guide


def require_solid(g: Gates) -> None:
    """Raise GateError for the first gate that fails; the cavity's volume may be off by CAVITY_TOLERANCE."""
    genus, wanted = g.lattice_genus, g.lattice_genus_expected
    require(
        (
            g.lattice_components == 1,
            "lattice in one piece",
            f"the bare lattice falls into {g.lattice_components} pieces",
        ),
        (genus == wanted, "lattice genus", f"the bare lattice has genus {genus}, E - V + 1 is {wanted}"),
        *of_surface(g.components, g.bad_edges, g.bad_edges_after_stl),
        (
            g.inner_shells == 1,
            "one cavity",
            f"with the inlet plugged there are {g.inner_shells} inner shells, not one: a leak or voids",
        ),
        (
            abs(g.inner_volume_error) <= CAVITY_TOLERANCE,
            "cavity volume",
            f"the cavity holds {g.inner_volume_mm3:.1f} mm3 and not {g.inner_volume_expected_mm3:.1f} mm3",
        ),
    )


Gate = tuple[bool, str, str]
"""Whether a gate holds, its name, and what is so where it does not."""


def of_surface(components: int, bad: int, bad_after_stl: int) -> tuple[Gate, ...]:
    """The gates of every printed surface, by its number of pieces and of open edges, before and after STL."""
    return (
        (
            components == 1,
            "one component",
            f"the surface has {components} pieces: loose bodies or sealed voids",
        ),
        (bad == 0, "closed surface", f"{bad} edges are not shared by two triangles"),
        (bad_after_stl == 0, "watertight STL", f"{bad_after_stl} edges are open once the STL is read back"),
    )


def require(
    *gates: Gate,
    of: str = "printable solid",
    remedy: str = "try the other quality or slightly different diameters",
) -> None:
    """Raise GateError for the first gate that does not hold."""
    for holds, gate, what in gates:
        if not holds:
            raise GateError(f"{what} (gate: {gate})", of, remedy)
