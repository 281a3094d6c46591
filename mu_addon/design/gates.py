"""Geometry checks (gates) of a printable solid: required numbers before it is written."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NoReturn

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
    if solid.status() != manifold3d.Error.NoError:
        _fail("closed surface", f"the surface is not a manifold: {solid.status().name}")
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
    require(gates)
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
    if guide.strayed_mm3 > STRAYED_MM3:
        _fail(
            "cuts clear of struts and membrane",
            f"wells or pockets of the waveguide take {guide.strayed_mm3:.3g} mm3 from struts or membrane",
        )
    if guide.components != 1:
        _fail("waveguide in one piece", f"lattice and waveguide fall into {guide.components} pieces")
    if guide.genus != guide.genus_expected:
        _fail(
            "waveguide genus",
            f"the lattice with its waveguide has genus {guide.genus}, its graph {guide.genus_expected}: "
            "a well or a seat makes a tunnel or closes one",
        )
    return guide


def require(gates: Gates) -> None:
    """Raise GateError for the first gate that fails; the cavity's volume may be off by CAVITY_TOLERANCE."""
    g = gates
    if g.lattice_components != 1:
        _fail("lattice in one piece", f"the bare lattice falls into {g.lattice_components} pieces")
    if g.lattice_genus != g.lattice_genus_expected:
        _fail(
            "lattice genus",
            f"the bare lattice has genus {g.lattice_genus}, E - V + 1 is {g.lattice_genus_expected}",
        )
    if g.components != 1:
        _fail("one component", f"the surface has {g.components} pieces: loose bodies or sealed voids")
    if g.bad_edges:
        _fail("closed surface", f"{g.bad_edges} edges are not shared by two triangles")
    if g.bad_edges_after_stl:
        _fail("watertight STL", f"{g.bad_edges_after_stl} edges are open once the STL is read back")
    if g.inner_shells != 1:
        _fail(
            "one cavity",
            f"with the inlet plugged there are {g.inner_shells} inner shells, not one: a leak or voids",
        )
    if abs(g.inner_volume_error) > CAVITY_TOLERANCE:
        _fail(
            "cavity volume",
            f"the cavity holds {g.inner_volume_mm3:.1f} mm3 and not {g.inner_volume_expected_mm3:.1f} mm3",
        )


def _fail(gate: str, what: str) -> NoReturn:
    raise GateError(
        f"{what} (gate: {gate})", "printable solid", "try the other quality or slightly different diameters"
    )
