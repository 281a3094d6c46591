"""Graded struts: factor 1 changes nothing, a mirrored field mirrors the body, more resin is more resin."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.anchors import window
from mu_addon.design.figures import estimated_volume
from mu_addon.design.grading import ALONG_Z, LEAST, MOST, CellFactor, Field, Grading, cells_text, parsed
from mu_addon.design.lattice import lattice_of
from mu_addon.design.lattice_kinds import sin_squared
from mu_addon.design.parameters import Envelope, from_toml, load_preset, to_toml
from mu_addon.design.printing.check import _drawing
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.solid import build_solid
from mu_addon.design.steps import Stack, StepInputs
from mu_addon.design.waveguide import waveguide
from mu_addon.errors import InputError

UNIT = load_preset("mu-1.0x")
FACTORS = st.floats(0.8, 1.25)


def with_grading(unit=UNIT, **values):
    return attrs.evolve(unit, grading=Grading(**values))


@st.composite
def gradings(draw):
    named = {name: draw(FACTORS) for name in (*ALONG_Z, "minus_y", "plus_y", "beside_x")}
    cells = st.tuples(st.integers(0, 1), st.integers(-1, 2), st.integers(1, 6))
    entries = draw(st.dictionaries(cells, st.floats(0.8, 1.25), max_size=4))
    return Grading(**named, cells=cells_text(CellFactor(*key, f) for key, f in entries.items()))


def field_of(grading, cell=12.5):
    return Field(grading, cell, 6, 1, 1, 2)


POINTS = st.lists(
    st.tuples(st.floats(-18.75, 18.75), st.floats(-18.75, 31.25), st.floats(0.0, 75.0)),
    min_size=1,
    max_size=8,
).map(np.array)


@given(POINTS)
def test_a_factor_of_one_everywhere_is_one(points):
    assert (field_of(Grading(cells="* * *: 1.0")).at(points) == 1.0).all()


@given(gradings(), POINTS)
@settings(max_examples=60)
def test_the_field_is_its_own_mirror_image_and_between_its_values(grading, points):
    field = field_of(grading)
    found = field.at(points)
    assert (field.at(points * [-1.0, 1.0, 1.0]) == found).all()
    along = [getattr(grading, name) for name in ALONG_Z]
    cells = [f for *_, f in grading.entries] + [1.0]
    low = min(along) * min(1, grading.minus_y, grading.plus_y) * min(1, grading.beside_x) * min(cells)
    high = max(along) * max(1, grading.minus_y, grading.plus_y) * max(1, grading.beside_x) * max(cells)
    assert ((found >= low * (1 - 1e-12)) & (found <= high * (1 + 1e-12))).all()


def test_values_hold_where_they_are_said_to():
    field = field_of(
        Grading(base=0.8, lower=0.9, tip=1.2, minus_y=0.7, plus_y=1.5, beside_x=0.6, cells="0 0 2: 1.1")
    )
    u = 12.5
    at = field.at(
        np.array(
            [[0, 0, 0], [0, 0, 0.5 * u], [0, 0, 5.5 * u], [0, 0, 6 * u], [0, -u, 5.5 * u],
             [0, 2 * u, 5.5 * u], [u, 0, 5.5 * u], [-1.5 * u, u, 5.5 * u], [0, 0, 1.5 * u], [u, 0, 1.5 * u]]
        )
    )  # fmt: skip
    second = 0.8 + 0.1 * (1.0 / 1.25)
    assert at == pytest.approx(
        [0.8, 0.8, 1.2, 1.2, 0.84, 1.8, 0.72, 0.72 * 1.25, second * 1.1, second * 0.6], rel=1e-12
    )


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("0 1 2", "is not an entry"),
        ("0 1 2: much", "is not an entry"),
        ("-1 1 2: 0.9", "is not an entry"),
        ("0 1 2: nan", "is not an entry"),
        ("0 1 2: 3", "out of bounds"),
        ("0 1 2: 0.9; 0 1 2: 0.8", "twice"),
    ],
)
def test_broken_entries_are_refused(text, what):
    with pytest.raises(InputError, match=what) as error:
        Grading(cells=text)
    assert error.value.where == "[grading] cells"
    assert error.value.remedy
    with pytest.raises(InputError, match="line 3"):
        from_toml(f'format = 1\n[grading]\ncells = "{text}"\n')


def test_bounds_and_types():
    for value in (LEAST / 2, 2 * MOST, float("nan"), "wide"):
        with pytest.raises(InputError, match="tip"):
            Grading(tip=value)
    with pytest.raises(InputError, match="not a text"):
        Grading(cells=3)
    assert parsed(" ; 1 -1 *: 0.9 ;") == (CellFactor(1, -1, None, 0.9),)
    # However entries are written, the unit is the same.
    assert Grading(cells="1 0 2:0.90; * * 1 : 1.1") == Grading(cells="* * 1: 1.1;1 0 2: 0.9;0 0 1: 1.0")


def test_a_unit_without_grading_is_what_it_was():
    """Its file says nothing of grading, and its lattice is the plain one."""
    assert "grading" not in to_toml(UNIT)
    d = UNIT.dimensions
    assert d.grading is None
    lattice, t = lattice_of(d), np.linspace(0.0, 1.0, 9)
    assert (lattice.radii(t) == sin_squared(t, 0.75, 1.0)).all()
    assert (lattice.node_radii == 0.75).all()


@given(gradings())
@settings(max_examples=20)
def test_toml_keeps_a_grading(grading):
    unit = attrs.evolve(UNIT, grading=grading)
    assert from_toml(to_toml(unit)) == unit
    assert (unit.hash() == UNIT.hash()) == (grading == Grading())


@given(gradings(), st.sampled_from(["body-centred", "body-centred-straight"]))
@settings(max_examples=15)
def test_struts_that_meet_have_one_radius_and_mirrored_ones_are_alike(grading, kind):
    unit = attrs.evolve(UNIT, grading=grading, lattice=Envelope(kind=kind), scale=0.75)
    lattice = lattice_of(unit.dimensions)
    radii = lattice.radii([0.0, 0.25, 0.5, 0.75, 1.0])
    for column, end in ((0, 0), (-1, 1)):
        assert radii[:, column] == pytest.approx(lattice.node_radii[lattice.struts[:, end]], rel=1e-12)
    factor = lattice.factors[lattice.struts]
    middle = lattice.kind.radius(np.array([0.5]), lattice.junction_radius, lattice.midspan_radius)
    assert radii[:, 2] == pytest.approx(middle * factor.mean(axis=1), rel=1e-12)

    def by_place(sign):
        ends = np.round(lattice.nodes[lattice.struts] * [sign, 1, 1] * 1e6).astype(int) + 0
        return {(tuple(a), tuple(b)): r for (a, b), r in zip(ends.tolist(), radii.tolist(), strict=True)}

    here, there = ({tuple(map(tuple, k)): v for k, v in by_place(s).items()} for s in (1.0, -1.0))
    assert here == there


@given(gradings(), st.sampled_from(ALONG_Z), st.floats(1.01, 1.2))
@settings(max_examples=15)
def test_more_diameter_is_more_resin(grading, name, more):
    thicker = attrs.evolve(grading, **{name: getattr(grading, name) * more})
    volumes = [
        estimated_volume(unit, Stack().value("struts", StepInputs(unit)))
        for unit in (attrs.evolve(UNIT, grading=g) for g in (grading, thicker))
    ]
    assert volumes[1] > volumes[0]


def test_print_offset_is_added_and_not_multiplied():
    unit = attrs.evolve(
        with_grading(cells="* * *: 0.8"), print=attrs.evolve(UNIT.print, offset_xy_mm=0.1, offset_z_mm=0.1)
    )
    radii = lattice_of(unit.printed).radii([0.0, 0.5])
    assert radii == pytest.approx(np.tile([0.8 * 0.75 + 0.1, 0.8 * 1.0 + 0.1], (len(radii), 1)), rel=1e-9)


@pytest.mark.slow
def test_a_graded_solid_passes_its_gates_and_has_its_struts_volume():
    """Its volume between those of even struts, and nearly as the cells' density integrates."""
    small = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))
    whole = {
        name: build_solid(with_grading(small, **values)).gates.volume_mm3
        for name, values in {
            "thin": {"cells": "* * *: 0.8"},
            "plain": {},
            "graded": {"base": 0.8, "lower": 0.9, "upper": 1.1, "tip": 1.2, "plus_y": 0.9},
            "thick": {"cells": "* * *: 1.2"},
        }.items()
    }
    assert whole["thin"] < whole["graded"] < whole["thick"]
    # Along the struts' axes: the sum of its struts' own volumes, by that of the ungraded one.
    changes = {}
    for name, values in (
        ("plain", {}),
        ("graded", {"base": 0.8, "lower": 0.9, "upper": 1.1, "tip": 1.2, "plus_y": 0.9}),
    ):
        unit = with_grading(small, **values)
        changes[name] = estimated_volume(unit, Stack().value("struts", StepInputs(unit)))
    assert whole["graded"] - whole["plain"] == pytest.approx(changes["graded"] - changes["plain"], rel=0.06)


@pytest.mark.nightly("test_a_graded_solid_passes_its_gates_and_has_its_struts_volume")
def test_wells_and_seats_keep_clear_of_thicker_struts():
    plain = waveguide(UNIT, window(UNIT, "alpha10"))
    thick = waveguide(with_grading(plus_y=1.9), window(UNIT, "alpha10"))
    assert len(thick.wells) < len(plain.wells)
    solid = build_solid(with_grading(plus_y=1.3, tip=0.8), window(UNIT, "alpha10"))
    assert solid.gates.guide.strayed_mm3 < 1e-6
    raised = build_solid(with_grading(plus_y=0.7), window(UNIT, "alpha10"))
    assert raised.gates.guide.components == 1


def test_a_muted_grading_is_drawn_without():
    unit = with_grading(tip=0.7)
    stack = Stack()
    t = np.linspace(0.0, 1.0, 5)
    muted = stack.value("struts", StepInputs(unit, muted={"grading"}))
    assert (muted.lattice.radii(t) == lattice_of(UNIT.dimensions).radii(t)).all()
    drawn = stack.value("struts", StepInputs(unit))
    assert (drawn.lattice.radii(t) == lattice_of(unit.dimensions).radii(t)).all()
    assert drawn.lattice.radii(t).min() == pytest.approx(0.7 * 0.75)


def test_the_print_check_names_the_thinnest_graded_strut():
    printer = load_printer("form-4-elastic-50a")
    (plain,) = (f for f in _drawing(UNIT, None, printer) if f.check == "thinnest strut")
    assert (plain.severity, plain.value) == ("pass", 1.5)
    unit = with_grading(tip=0.6)
    (thin,) = (f for f in _drawing(unit, None, printer) if f.check == "thinnest strut")
    assert thin.severity == "warning"
    assert thin.value == pytest.approx(0.9)
    assert "grading" in thin.what
    assert len(thin.places)
    assert (thin.places[:, 2] >= 5.5 * 12.5 - 1e-9).all()


def test_the_straight_kind_is_graded_too():
    unit = attrs.evolve(UNIT, lattice=Envelope(kind="body-centred-straight"), grading=Grading(base=0.8))
    radii = lattice_of(unit.dimensions).radii([0.0, 0.5, 1.0])
    assert radii.min() == pytest.approx(0.8)
    assert radii.max() == pytest.approx(1.0)
