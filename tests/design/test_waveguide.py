import itertools
from functools import cache

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design import gates, shapes
from mu_addon.design import solid as solids
from mu_addon.design.anchors import anchor_points, window, windows
from mu_addon.design.block import Block
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Chambers, Envelope, Unit, Waveguide, load_preset
from mu_addon.design.profile import outer_radius
from mu_addon.design.waveguide import free_bar, strut_radii, waveguide
from mu_addon.errors import InputError
from mu_addon.placement.graph import Limits, lattice_graph

from .kinds import cross, custom
from .units import units

# Chains of different lengths and bends, out of the 3210 of the lattice.
BENT = (0, 394, 591, 985, 1379, 1970, 2955)
PRESETS = ("mu-0.75x", "mu-1.0x", "mu-1.5x")


@cache
def chains(name):
    graph = lattice_graph(load_preset(name).printed)
    return [graph.nodes[list(chain)] for chain in graph.chains(Limits())]


@cache
def bent(name, number):
    return waveguide(load_preset(name), chains(name)[number])


@cache
def built(name, path):
    unit = load_preset(name)
    return solids.build_solid(unit, window(unit, path) if isinstance(path, str) else chains(name)[path])


@pytest.mark.parametrize(("name", "per_span"), [("mu-0.75x", 2), ("mu-1.0x", 3), ("mu-1.5x", 5)])
def test_number_of_wells_follows_the_length(name, per_span):
    unit = load_preset(name)
    for w in windows(6):
        bar = waveguide(unit, w)
        assert len(bar.wells) == per_span * (w.length - 1)
        for well in bar.wells:
            assert 2 * well.half[0] == pytest.approx(1.0)
            # Its floor lies 0.65 mm below the outer face, which is 0.75 mm from the axis.
            floor = (well.corners - [0, bar.points[0, 1], 0])[:, 1].min()
            assert floor == pytest.approx(0.75 - 0.65)
        low, high = bar.legs.reshape(-1, 3).min(axis=0), bar.legs.reshape(-1, 3).max(axis=0)
        assert (high - low)[:2] == pytest.approx([1.5, 1.5])
        assert (high - low)[2] >= (w.length - 1) * unit.dimensions.cell + 5.0 - 1e-9
        assert bar.path_mm == pytest.approx((w.length - 1) * unit.dimensions.cell)


@given(units())
@settings(max_examples=30)
def test_wells_keep_their_pitch_and_clear_of_the_junctions(unit):
    d, w = unit.dimensions, windows(unit.dimensions.count)[-1]
    bar = waveguide(unit, w)
    at = np.array([well.centre[2] for well in bar.wells]) - anchor_points(unit)[0, 2]
    steps = np.diff(at) / d.well_pitch
    assert steps == pytest.approx(np.rint(steps), abs=1e-6)
    nodes = anchor_points(unit)[:, 2] - anchor_points(unit)[0, 2]
    if len(at):
        assert np.abs(at[:, None] - nodes).min() > d.well_width / 2 + d.waveguide_section / 2
    low, high = np.array(d.bounds).T
    corners = bar.legs.reshape(-1, 3)
    assert (corners >= low - 1e-9).all()
    assert (corners <= high + 1e-9).all()


def test_wells_face_away_from_the_axis():
    for row in (2, 1, -1):
        bar = waveguide(Unit(waveguide=Waveguide(row=row, seats=abs(row) > 1)), windows(6)[0])
        assert bar.normals == pytest.approx(np.array([[0, np.sign(row), 0]]))


@pytest.mark.parametrize("number", BENT)
def test_a_bent_waveguide_is_one_bar_of_one_section(number):
    """Its volume is section times length whatever its bends: mitres take from one leg what they add."""
    bar = attrs.evolve(bent("mu-1.0x", number), seats=())
    length = np.linalg.norm(np.diff(bar.points, axis=0), axis=1).sum()
    assert bar.solid().volume() == pytest.approx(1.5**2 * length, rel=1e-9)
    assert len(bar.solid().decompose()) == 1
    way = np.diff(bar.points, axis=0) / np.linalg.norm(np.diff(bar.points, axis=0), axis=1)[:, None]
    assert np.abs(np.einsum("ij,ij->i", way, bar.normals)).max() < 1e-9
    # Neighbouring faces meet without a twist: the normal turns about the bend's axis alone.
    for k, (a, b) in enumerate(itertools.pairwise(bar.normals)):
        axis = np.cross(way[k], way[k + 1])
        assert a @ axis == pytest.approx(b @ axis, abs=1e-9)


def test_wells_of_a_bent_path_stand_at_whole_pitches_along_it():
    """Along the path from its first node, round its bends; half or more of all that would fit lie open."""
    for number in BENT:
        bar, first = bent("mu-1.0x", number), chains("mu-1.0x")[number][0]
        way = np.diff(bar.points, axis=0)
        length = np.linalg.norm(way, axis=1)
        begin = np.concatenate([[0], np.cumsum(length)]) - np.linalg.norm(first - bar.points[0])
        for well in bar.wells:
            from_start = (
                well.centre
                - bar.points[:-1]
                - well.axes[1] * (well.centre - bar.points[:-1]).dot(well.axes[1])[:, None]
            )
            along = np.einsum("ij,ij->i", from_start, way / length[:, None])
            off = np.linalg.norm(from_start - along[:, None] * way / length[:, None], axis=1)
            leg = int(np.argmin(off + 9.0 * ((along < 0) | (along > length))))
            assert off[leg] < 1e-9
            pitches = (begin[leg] + along[leg]) / 3.125
            assert pitches == pytest.approx(round(pitches), abs=1e-6)
        assert len(bar.wells) >= 0.5 * bar.path_mm / 3.125
    paths = [bent("mu-1.0x", number) for number in BENT]
    assert np.corrcoef([p.path_mm for p in paths], [len(p.wells) for p in paths])[0, 1] > 0.9


@pytest.mark.parametrize("number", [1517, 2424])
def test_wells_and_pockets_are_clear_of_struts(number):
    """Against struts' own surfaces: no point of one lies within a box that is cut out."""
    bar = bent("mu-1.5x", number)
    lattice = lattice_of(load_preset("mu-1.5x").dimensions)
    t = np.linspace(0, 1, 201)
    kept = ~bar.replaced
    ends = lattice.nodes[lattice.struts[kept]]
    radii = strut_radii(lattice, bar.met[kept], bar.half, t, kept)
    for cut in bar.cuts:
        for (start, end), radius in zip(ends, radii, strict=True):
            if np.linalg.norm((start + end) / 2 - cut.centre) > 14:
                continue
            ring = shapes.ring(end - start, 24)
            points = start + t[:, None, None] * (end - start) + radius[:, None, None] * ring
            inside = np.abs((points - cut.centre) @ cut.axes.T) < cut.half
            assert not inside.all(axis=-1).any()


NIGHTLY = pytest.mark.nightly("test_every_gate_holds_with_a_waveguide")
BY_DAY = {("mu-0.75x", 1517), ("mu-1.0x", "alpha4")}


@pytest.mark.parametrize(
    ("name", "path"),
    [
        pytest.param(name, path, marks=() if (name, path) in BY_DAY else NIGHTLY)
        for name in PRESETS
        for path in ("alpha4", 1517, "alpha10", 2424)
    ],
)
def test_every_gate_holds_with_a_waveguide(name, path):
    g = built(name, path).gates
    bar = built(name, path).bar
    assert g.guide.genus == g.guide.genus_expected == 365 + bar.loops
    assert g.guide.components == g.components == 1
    assert g.guide.strayed_mm3 == pytest.approx(0.0, abs=1e-6)
    assert (g.bad_edges, g.bad_edges_after_stl, g.inner_shells) == (0, 0, 1)
    assert abs(g.inner_volume_error) < 0.01
    assert g.genus == 394 + bar.loops
    d = load_preset(name).dimensions
    seat = 2.3 * 1.55 * 1.0 + d.cable * d.seat_wall * 1.0
    assert g.guide.cut_mm3 == pytest.approx(len(bar.wells) * 1.0 * 0.65 * 1.5 + 2 * seat, rel=1e-6)


def test_the_part_and_its_wires_come_out():
    """What would be the part, on its way in, and a wire through the notch meet nothing that is printed."""
    import manifold3d

    s = built("mu-1.0x", "alpha4")
    body = manifold3d.Manifold(manifold3d.Mesh64(s.vertices, s.triangles.astype("uint64")))
    for seat in s.bar.seats:
        axes, half = seat.pocket.axes, np.array([0.85, 1.25, 2.0]) / 2
        face = seat.pocket.centre - seat.pocket.half[0] * axes[0]
        for back in (0.01, 0.5, 1.0, 1.8):
            part = Block(face + (back + half[0]) * axes[0], axes, half)
            assert (part.solid() ^ body).volume() == pytest.approx(0.0, abs=1e-9)
        wire = Block(seat.notch.centre + 1.0 * axes[1], axes, np.array([0.25, 1.0, 0.3]))
        assert (wire.solid() ^ body).volume() == pytest.approx(0.0, abs=1e-9)
        # The part lies flat on the waveguide's own end face: just behind it everything is solid.
        behind = Block(face - 0.05 * axes[0], axes, np.array([0.04, 0.7, 0.7]))
        assert (behind.solid() ^ body).volume() == pytest.approx(behind.volume, rel=1e-6)


def test_struts_at_the_path_are_no_thinner_than_the_waveguide():
    unit = load_preset("mu-0.75x")
    lattice, bar = lattice_of(unit.dimensions), waveguide(unit, window(unit, "alpha4"))
    t = np.linspace(0, 1, 21)
    radii, law = strut_radii(lattice, bar.met, bar.half, t), lattice.radius(t)
    first = bar.met[:, 0] & ~bar.met[:, 1]
    assert first.sum() == 3 * 8
    assert (radii[first][:, t <= 0.5] >= 0.75 - 1e-12).all()
    assert radii[first][:, -1] == pytest.approx(law[-1])
    assert (radii >= law - 1e-12).all()
    assert radii[~bar.met.any(axis=1)] == pytest.approx(np.tile(law, (len(radii) - 24, 1)))


def test_a_followed_strut_becomes_the_bar():
    bar = bent("mu-1.0x", 1517)
    lattice = lattice_of(load_preset("mu-1.0x").dimensions)
    assert bar.replaced.sum() == 3
    ends = lattice.nodes[lattice.struts[bar.replaced]]
    for start, end in ends:
        for point in (start, end):
            assert (
                np.linalg.norm(np.cross(point - bar.points[:-1], np.diff(bar.points, axis=0)), axis=1).min()
                < 1e-6
            )


@pytest.fixture(scope="module")
def held():
    """Lattice, its solid, a waveguide's bar, and the lattice with that bar."""
    unit = Unit(chambers=Chambers(count=3))
    d, facets = unit.dimensions, solids.QUALITY["interactive"]
    lattice, bar = lattice_of(d), waveguide(unit, windows(3)[0])
    bare = solids.lattice_solid(d, lattice, facets)
    return lattice, bare, bar, solids.with_waveguide(d, lattice, facets, bar, bare)


def test_a_well_in_a_strut_is_caught(held):
    lattice, bare, bar, holder = held
    stray = Block(anchor_points(Unit())[1] + [1.5, 1.5, 1.5], np.eye(3), np.array([0.4, 0.4, 0.4]))
    with pytest.raises(gates.GateError, match="gate: cuts clear of struts"):
        gates.check_waveguide(holder, bar.solid(), stray.solid(), [bare], lattice.cycles + bar.loops)


def test_a_well_through_the_bar_is_caught(held):
    lattice, _, bar, holder = held
    through = attrs.evolve(bar.wells[0], half=np.array([0.3, 3.0, 0.3])).solid()
    with pytest.raises(gates.GateError, match="gate: waveguide genus"):
        gates.check_waveguide(
            holder, bar.solid(), through, [shapes.box([0] * 3, [1] * 3)], lattice.cycles + 2
        )


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0, 25, 6.25], [1, 25, 18.75]], "is not a node of the lattice"),
        ([[0, 0, 6.25], [0, 0, 18.75]], "runs through the cavity"),
        ([[0, 25, 6.25]], "needs two different nodes"),
        ([[0, 25, 18.75], [6.25, 18.75, 25], [0, 25, 18.75]], "bends by 180 degrees"),
    ],
)
def test_paths_that_cannot_be_are_refused(points, words):
    with pytest.raises(InputError, match=words):
        waveguide(load_preset("mu-1.0x"), np.array(points, float))


def test_an_end_without_room_is_refused_and_goes_without_a_seat():
    unit = load_preset("mu-1.0x")
    wide = attrs.evolve(unit, waveguide=attrs.evolve(unit.waveguide, part_width_mm=10.0, part_length_mm=10.0))
    with pytest.raises(InputError, match="has no space for a seat: a strut is in the way"):
        waveguide(wide, window(wide, "alpha4"))
    bare = attrs.evolve(wide, waveguide=attrs.evolve(wide.waveguide, seats=False))
    bar = waveguide(bare, window(bare, "alpha4"))
    assert bar.seats == ()
    assert len(bar.wells) == 6


def test_a_lattice_with_upright_struts_has_no_seats_but_wells():
    """Struts along the path become the bar, those square to it cover wells only at the nodes."""
    unit = Unit(
        lattice=Envelope(**custom(cross()), junction_diameter_mm=1.0, midspan_diameter_mm=1.4),
        waveguide=Waveguide(seats=False),
    )
    p = anchor_points(unit)
    path = np.array([p[0], (p[0] + p[1]) / 2, p[1], (p[1] + p[2]) / 2, p[2]])
    bar = waveguide(unit, path)
    assert bar.replaced.sum() == 4
    assert bar.loops == 0
    past_nodes = waveguide(unit, p[:3])
    assert (past_nodes.replaced == bar.replaced).all()
    assert past_nodes.loops == 0
    # Balls of the struts that it replaces are wider than the bar: they go with them, or wells would cut them.
    assert solids.build_solid(unit.evolve(count=3), windows(3)[0]).bar is not None
    assert [well.centre[2] - p[0, 2] for well in bar.wells] == pytest.approx(
        [3.125, 6.25, 9.375, 15.625, 18.75, 21.875]
    )


def test_a_coupon_has_every_well():
    d = load_preset("mu-1.0x").dimensions
    bar = free_bar(d, 37.5)
    assert len(bar.wells) == 11
    assert len(bar.seats) == 2


@given(st.floats(0.1, 3.0), st.floats(-3.0, 3.0), st.integers(0, 2), st.integers(0, 10_000))
@settings(max_examples=30)
def test_a_block_is_its_corners(half, shift, axis, seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    axes = q * np.linalg.det(q)
    block = Block(np.full(3, shift), axes, np.array([half, 1.0, 2.0]))
    assert block.solid().volume() == pytest.approx(block.volume, rel=1e-6)
    longer = block.longer(axis, 0.5)
    assert longer.volume == pytest.approx(block.volume * (1 + 0.25 / block.half[axis]))
    grown = block.grown(np.full(3, 0.1))
    assert grown.half == pytest.approx(block.half + 0.1)
    assert block.grown(np.full(3, -0.05)).half == pytest.approx(block.half - 0.05)
    at = block.points(0.5)
    assert (np.abs((at - block.centre) @ axes.T) <= block.half + 1e-9).all()


def test_a_path_beside_a_bladder_keeps_its_wells_out_of_the_wall():
    unit = Unit(waveguide=Waveguide(row=1, seats=False))
    d = unit.dimensions
    for well in waveguide(unit, windows(6)[-1]).wells:
        points = well.points(0.2)
        assert (np.hypot(points[:, 0], points[:, 1]) > outer_radius(d, points[:, 2])).all()
