"""Kinds of lattice: the registry, what a kind must be, and one that is added from outside."""

import pickle
from itertools import product

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.design import lattice_kinds, solid
from mu_addon.design.anchors import window
from mu_addon.design.lattice import filled, lattice_of
from mu_addon.design.lattice_kinds import LatticeKind, constant, sin_squared
from mu_addon.design.parameters import Envelope, Unit, from_toml, read_unit, to_toml
from mu_addon.design.stl_and_nodes import write_nodes
from mu_addon.errors import InputError
from mu_addon.placement.graph import lattice_graph

from .kinds import BODY_CENTRED, CORNERS, STRAIGHT, custom, octet, simple_cubic, thirds


def from_centre(kind):
    """Struts (k, 3), in cells, that leave the node at the cell's centre, where the anchors are."""
    (centre,) = np.nonzero((2 * kind.grid == kind.divisions).all(axis=1))
    here = np.isin(kind.struts, centre)
    both = np.concatenate([kind.struts[here[:, 0]], kind.struts[here[:, 1]][:, ::-1]])
    return kind.nodes[both[:, 1]] - kind.nodes[both[:, 0]]


def test_shipped_kinds_differ_in_taper_only():
    assert lattice_kinds.names() == ("body-centred", "body-centred-straight", "custom")
    assert np.array_equal(BODY_CENTRED.nodes, STRAIGHT.nodes)
    t = np.array([0.0, 0.25, 0.5, 1.0])
    assert BODY_CENTRED.radius(t, 0.75, 1.0) == pytest.approx([0.75, 0.875, 1.0, 0.75])
    assert STRAIGHT.radius(t, 0.75, 1.0).tolist() == [1.0] * 4
    assert all(BODY_CENTRED.mirrors)
    assert sorted(map(tuple, np.abs(from_centre(BODY_CENTRED)).tolist())) == [(0.5, 0.5, 0.5)] * 8


@given(st.floats(0, 1), st.floats(0.1, 5), st.floats(0.1, 5))
def test_radii_stay_between_junction_and_mid_span(t, junction, midspan):
    low, high = sorted((junction, midspan))
    assert low - 1e-12 <= sin_squared(t, junction, midspan) <= high + 1e-12
    assert constant(t, junction, midspan) == midspan


def test_a_kind_survives_another_process():
    assert pickle.loads(pickle.dumps(BODY_CENTRED)) == BODY_CENTRED
    assert BODY_CENTRED != STRAIGHT
    unit = Unit()
    again = pickle.loads(pickle.dumps(unit))
    assert again == unit
    assert again.dimensions == unit.dimensions


def test_openings():
    """Least distance of struts without a common node: closed forms, and by brute force."""
    assert BODY_CENTRED.opening == pytest.approx(np.sqrt(0.5))
    assert simple_cubic().opening == pytest.approx(1.0)
    assert octet().opening == pytest.approx(0.5)
    for kind in (BODY_CENTRED, octet(), thirds()):
        t = np.linspace(0.0, 1.0, 13)[:, None]
        here = kind.nodes[kind.struts]
        every = (here + np.array(list(product((-1, 0, 1), repeat=3)))[:, None, None]).reshape(-1, 2, 3)
        points = every[:, :1] + t * (every[:, 1:] - every[:, :1])
        found = np.inf
        for ends in here:
            ends_meet = np.abs(every[:, :, None] - ends).max(axis=3).min(axis=(1, 2)) < 1e-9
            along = ends[0] + t * (ends[1] - ends[0])
            gaps = np.linalg.norm(points[~ends_meet][:, :, None] - along, axis=3)
            found = min(found, gaps.min())
        assert kind.opening == pytest.approx(found, abs=2e-3)


def test_struts_closer_than_an_opening_close_it():
    """Up to the opening the bare lattice keeps the genus of its graph; beyond it does not."""
    facets = solid.Facets(16, 2, 16, 4)
    nominal = attrs.evolve(Unit().dimensions, kind=STRAIGHT, count=3, cells_y_plus=1)
    for share, whole in ((0.97, True), (1.03, False)):
        width = share * STRAIGHT.opening * nominal.cell
        d = attrs.evolve(nominal, junction_diameter=width, midspan_diameter=width)
        lattice = lattice_of(d)
        body = solid.lattice_solid(d, lattice, facets)
        assert (body.genus() == lattice.cycles and len(body.decompose()) == 1) is whole


BAD = {
    "outside": ({"nodes": [(0, 0, 0), (1.5, 0, 0)], "struts": [(0, 1)]}, "a node outside its cell"),
    "no number": ({"nodes": [(0, 0, 0), (np.nan, 0, 0)], "struts": [(0, 1)]}, "a node outside its cell"),
    "fraction": ({"nodes": [(0, 0, 0), (1 / np.pi, 0, 0)], "struts": [(0, 1)]}, "not at a simple fraction"),
    "twice": ({"nodes": [(0, 0, 0), (0, 0, 0)], "struts": [(0, 1)]}, "two nodes at the same position"),
    "none": ({"nodes": CORNERS, "struts": []}, "no struts"),
    "nowhere": ({"nodes": CORNERS, "struts": [(0, 8)]}, "a node that does not exist"),
    "point": ({"nodes": CORNERS, "struts": [(3, 3)]}, "zero length"),
    "double": ({"nodes": CORNERS, "struts": [(0, 1), (1, 0)]}, "duplicate strut"),
    "crossing": ({"nodes": CORNERS, "struts": [(0, 7), (1, 6)]}, "cross where there is no node"),
    "one way": (
        {"nodes": CORNERS, "struts": [(0, 1)], "radius": lambda t, a, b: a + t * (b - a)},
        "depends on a strut's direction",
    ),
    "thin": ({"nodes": CORNERS, "struts": [(0, 1)], "radius": lambda t, a, b: 0 * t}, "not positive"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_kind_is_named(case):
    given, what = BAD[case]
    with pytest.raises(InputError, match="lattice 'mine'") as caught:
        LatticeKind("mine", **given)
    assert what in caught.value.what
    assert caught.value.remedy


def test_a_text_of_struts_is_the_kind_and_has_one_canonical_form():
    for kind in (BODY_CENTRED, STRAIGHT, octet(), thirds()):
        text = lattice_kinds.text_of(kind)
        again = lattice_kinds.parsed("mine", text, "here")
        assert lattice_kinds.text_of(again) == text
        assert again.radius is kind.radius
        np.testing.assert_array_equal(again.nodes[again.struts], kind.nodes[kind.struts])
    said = "straight\n 0.5 0.50 1/2 to 0 0 0 ;\n\n1/2 2/4 1/2  to 1 1 1\n"
    assert lattice_kinds.canonical_text(said) == "straight; 1/2 1/2 1/2 to 0 0 0; 1/2 1/2 1/2 to 1 1 1"
    assert lattice_kinds.canonical_text(" ") == ""


@pytest.mark.parametrize(
    ("lattice", "line", "what"),
    [
        ('kind = "octopus"', 3, "'octopus' is not known"),
        ('kind = "custom"', 3, "has no struts"),
        ('kind = "custom"\nstruts = "0 0 0 to 1 1"', 4, "is not a strut between two nodes"),
        ('kind = "custom"\nstruts = "0 0 0 to 1/0 1 1"', 4, "is not a strut between two nodes"),
        ('kind = "custom"\nstruts = "0 0 0 to 2 1 1"', 4, "a node outside its cell"),
        ('struts = "0 0 0 to 1 1 1"', 3, "no effect with another kind"),
        ('kind = "none.toml"', None, "cannot read the lattice kind"),
        ('kind = "mine.toml"', None, "struts is missing"),
        ('kind = "mine.toml"\nstruts = "0 0 0 to 1 1 1"', 4, "no effect with another kind"),
        (f'kind = "custom"\nstruts = "{"0 0 0 to 1 1 1; " * 201}"', 4, "a cell of 201 struts"),
    ],
)
def test_a_kind_that_does_not_fit_is_refused_at_its_line(lattice, line, what, tmp_path):
    (tmp_path / "mine.toml").write_text("# nothing\n")
    (tmp_path / "unit.toml").write_text(f"format = 1\n[lattice]\n{lattice}\n")
    with pytest.raises(InputError) as caught:
        read_unit(tmp_path / "unit.toml")
    assert what in caught.value.what
    assert (f"line {line}" if line else "e.toml") in caught.value.where
    assert caught.value.remedy


def test_another_kind_fills_a_unit(tmp_path):
    """A unit's own struts go with it through file, nodes, solid and graph."""
    unit = from_toml(to_toml(Unit(lattice=Envelope(**custom(simple_cubic())))))
    d = unit.dimensions
    assert d.kind == lattice_kinds.kind("custom", lattice_kinds.text_of(simple_cubic()))
    lattice = lattice_of(d)
    nx, ny, nz = 3, 4, 6
    assert len(lattice.nodes) == (nx + 1) * (ny + 1) * (nz + 1)
    assert len(lattice.struts) == (
        nx * (ny + 1) * (nz + 1) + (nx + 1) * ny * (nz + 1) + (nx + 1) * (ny + 1) * nz
    )
    ends = lattice.nodes[lattice.struts]
    assert np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) == pytest.approx(d.cell)
    assert lattice.is_corner.all()
    assert solid.build_solid(unit).gates.lattice_genus == lattice.cycles
    write_nodes(unit, tmp_path / "nodes.txt")
    rows = [row.split() for row in (tmp_path / "nodes.txt").read_text().splitlines() if row[0] != "#"]
    assert [row[1] for row in rows] == ["corner"] * len(lattice.nodes)
    graph = lattice_graph(d)
    assert graph.lengths == pytest.approx(d.cell)
    with pytest.raises(InputError, match="no node at the cell's centre"):
        solid.build_solid(unit, window(unit, "alpha1"))


def test_shared_nodes_at_thirds_are_found_exactly():
    kind = thirds()
    assert kind.divisions == 6
    cells = np.array(list(product(range(2), repeat=3))) * kind.divisions
    lattice = filled(kind, cells, 12.5, 0.5, 0.5)
    assert len(lattice.nodes) == 27 + 2 * 54
    assert len(lattice.struts) == 3 * 54
    assert lattice.on_face.all()
    assert not lattice.inside.any()


def test_a_one_sided_kind_is_no_units_lattice():
    slanted = LatticeKind("slanted", [(0.5, 0.5, 0.5), *CORNERS], [(0, 1), (0, 8)])
    assert slanted.mirrors == (False, False, False)
    with pytest.raises(InputError, match="is not its own mirror image across x"):
        Unit(lattice=Envelope(**custom(slanted)))
