import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.anchors import SHORTEST, anchors, window, windows
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Envelope, Unit, Waveguide, load_preset
from mu_addon.design.waveguide import junction_reach, waveguide, well_centres
from mu_addon.errors import InputError

from .units import units


@given(units())
@settings(max_examples=40, deadline=None)
def test_lattice_is_lattice_of(unit):
    d = unit.dimensions
    lattice = lattice_of(d)
    nx, ny, nz = d.cells_x, d.cells_y_minus + 1 + d.cells_y_plus, d.count
    assert lattice.is_centre.sum() == nx * ny * nz
    assert (~lattice.is_centre).sum() == (nx + 1) * (ny + 1) * (nz + 1)
    assert len(lattice.struts) == 8 * nx * ny * nz
    assert len(np.unique(np.rint(lattice.nodes / d.cell * 4).astype(int), axis=0)) == len(lattice.nodes)
    ends = lattice.nodes[lattice.struts]
    assert np.abs(ends[:, 1] - ends[:, 0]) == pytest.approx(np.full((len(ends), 3), d.cell / 2))
    assert lattice.is_centre[lattice.struts].tolist() == [[True, False]] * len(ends)
    low, high = np.array(d.bounds).T
    assert lattice.nodes.min(axis=0) == pytest.approx(low)
    assert lattice.nodes.max(axis=0) == pytest.approx(high)


def test_nodes_coincide_with_the_bladder_apices():
    d = load_preset("mu-1.0x").dimensions
    nodes = {tuple(node) for node in np.round(lattice_of(d).nodes, 9)}
    for k in range(6):
        z = (k + 0.5) * d.cell
        for apex in ((d.R, 0.0, z), (-d.R, 0.0, z), (0.0, d.R, z), (0.0, -d.R, z)):
            assert apex in nodes


def test_lattice_is_its_own_mirror_image_in_the_bending_plane():
    nodes = lattice_of(Unit().dimensions).nodes
    mirrored = nodes * [-1, 1, 1]
    assert {tuple(n) for n in nodes} == {tuple(n + 0.0) for n in mirrored}


def test_cycles_of_the_paper_unit():
    lattice = lattice_of(
        Unit(lattice=Envelope(cells_y_plus=1, allow_symmetric=True), waveguide=Waveguide(row=1)).dimensions
    )
    assert (len(lattice.struts), len(lattice.nodes), lattice.cycles) == (432, 166, 267)
    assert lattice_of(Unit().dimensions).cycles == 576 - 212 + 1


def test_struts_are_narrow_at_junctions_and_wide_at_mid_span():
    lattice = lattice_of(Unit().dimensions)
    assert lattice.radius([0.0, 0.5, 1.0]) == pytest.approx([0.75, 1.0, 0.75])
    t = np.linspace(0, 0.5, 50)
    assert (np.diff(lattice.radius(t)) > 0).all()
    assert lattice.radius(1 - t) == pytest.approx(lattice.radius(t))


@given(st.integers(3, 30))
def test_windows_count_and_order(n):
    every = windows(n)
    assert len(every) == (n - 2) * (n - 1) // 2
    assert [w.name for w in every] == [f"alpha{i}" for i in range(1, len(every) + 1)]
    assert [(w.length, w.start) for w in every] == sorted({(w.length, w.start) for w in every})
    for w in every:
        assert w.length >= SHORTEST
        assert w.indices[0] >= 0
        assert w.indices[-1] < n
        assert len(w.indices) == w.length


def test_the_papers_ten_windows():
    expected = [(1, 3), (2, 3), (3, 3), (4, 3), (1, 4), (2, 4), (3, 4), (1, 5), (2, 5), (1, 6)]
    assert [(w.start, w.length) for w in windows(6)] == expected
    assert window(Unit(), "alpha4").indices == range(3, 6)
    with pytest.raises(InputError, match="no path 'alpha11'"):
        window(Unit(), "alpha11")


@given(units())
@settings(max_examples=40, deadline=None)
def test_anchors_are_lattice_centres_in_the_bending_plane(unit):
    d, points = unit.dimensions, anchors(unit)
    assert points.shape == (d.count, 3)
    lattice = lattice_of(d)
    for point in points:
        gap = np.linalg.norm(lattice.nodes - point, axis=1)
        assert gap.min() < 1e-9 * d.cell
        assert lattice.is_centre[gap.argmin()]
    assert (points[:, 0] == 0).all()
    assert np.diff(points[:, 2]) == pytest.approx(d.cell)


@pytest.mark.parametrize(("name", "per_span"), [("mu-0.75x", 2), ("mu-1.0x", 3), ("mu-1.5x", 5)])
def test_number_of_wells_follows_the_length(name, per_span):
    unit = load_preset(name)
    for w in windows(6):
        bar = waveguide(unit, w)
        assert len(bar.wells) == per_span * (w.length - 1)
        size = bar.wells[:, 1] - bar.wells[:, 0]
        assert size[:, 2] == pytest.approx(1.0)
        depth = bar.box[1, 1] - bar.wells[:, 0, 1]
        assert depth == pytest.approx(0.65)
        assert bar.box[1] - bar.box[0] == pytest.approx(
            [1.5, 1.5, (w.length - 1) * unit.dimensions.cell + 5.0]
        )


@given(units())
@settings(max_examples=60, deadline=None)
def test_wells_keep_their_pitch_and_clear_of_the_junctions(unit):
    d, w = unit.dimensions, windows(unit.dimensions.count)[-1]
    at = well_centres(d, w.length - 1)
    steps = np.diff(at) / d.well_pitch
    assert steps == pytest.approx(np.rint(steps), abs=1e-6)
    nodes = anchors(unit)[:, 2] - anchors(unit)[0, 2]
    if len(at):
        assert np.abs(at[:, None] - nodes).min() > d.well_width / 2 + d.waveguide_section / 2
    bar = waveguide(unit, w)
    low, high = np.array(d.bounds).T
    assert (bar.box[0] >= low - 1e-9).all()
    assert (bar.box[1] <= high + 1e-9).all()


def test_struts_reach_as_far_along_the_bar_as_said():
    """Against points sampled on a strut's surface where it crosses the plane of the bar's outer face."""
    d = load_preset("mu-1.5x").dimensions
    lattice, h = lattice_of(d), d.waveguide_section / 2
    along = np.ones(3) / np.sqrt(3)
    side = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
    other = np.cross(along, side)
    length = np.sqrt(0.75) * d.cell
    s, angle = np.meshgrid(np.linspace(0, length, 4001), np.linspace(0, 2 * np.pi, 721))
    radius = lattice.radius(s / length)[..., None]
    points = s[..., None] * along + radius * (
        np.cos(angle)[..., None] * side + np.sin(angle)[..., None] * other
    )
    on_face = np.abs(points[..., 1] - h) < 0.005
    assert points[on_face][:, 2].max() == pytest.approx(junction_reach(d), abs=0.02)


def test_wells_face_away_from_the_axis():
    for row in (2, 1, -1):
        unit = Unit(waveguide=Waveguide(row=row))
        bar = waveguide(unit, windows(6)[0])
        y = bar.wells[..., 1]
        outer_face = bar.box[1 if row > 0 else 0, 1]
        assert np.abs(y - outer_face).min(axis=1) == pytest.approx(0.03)
        assert np.abs(y).max() > abs(outer_face)
