"""The nearest value that keeps every rule, and parameters that rules tie."""

import attrs
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.design.parameters import SECTIONS, Unit
from mu_addon.design.quantity import describe
from mu_addon.design.repairs import nearest_fit, repairs, tied
from mu_addon.errors import InputError


def changed(section, name, value):
    sections = {s.section: s() for s in SECTIONS}
    sections[section] = attrs.evolve(sections[section], **{name: value})
    return sections


def made(sections, scale, section, name, value):
    """Whether a unit can be made with that value."""
    own = attrs.evolve(sections[section], **tied({name: value}))
    try:
        return Unit(scale=scale, **{**sections, section: own})
    except InputError:
        return None


@pytest.mark.parametrize(
    ("section", "name", "value", "expected"),
    [
        ("chambers", "wall_mm", 3.0, 1.874),  # it folds from 1.875 on
        ("chambers", "inlet_diameter_mm", 13.0, 9.5),  # with its boss it is as wide as the neck
        ("chambers", "neck_diameter_mm", 30.0, 24.999),
        ("chambers", "cell_mm", 14.0, 14.0),  # with a bladder twice as wide, which it drives
        ("lattice", "cells_x", 4, 3),
        ("lattice", "midspan_diameter_mm", 12.0, 8.838),
        ("waveguide", "row", 0, -1),
        ("waveguide", "well_width_mm", 4.0, 3.124),
    ],
)
def test_the_value_that_the_rule_allows(section, name, value, expected):
    assert nearest_fit(changed(section, name, value), 1.0, section, name) == expected


NUMBERS = [(s.section, d) for s in SECTIONS for d in describe(s) if d.type is float and d.unit == "mm"]


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(NUMBERS), st.floats(0.0, 1.0), st.sampled_from([0.5, 1.0, 2.0]))
def test_what_is_offered_fits_and_what_lies_just_short_of_it_does_not(place, share, scale):
    section, d = place
    value = round(d.low + share * (d.high - d.low), 3)
    sections = changed(section, d.name, value)
    found = nearest_fit(sections, scale, section, d.name)
    if found is None:
        return
    assert made(sections, scale, section, d.name, found)
    if found != value:
        short = round(found + (0.001 if value > found else -0.001), 3)
        assert not made(sections, scale, section, d.name, short)


def test_what_has_no_value_that_fits():
    sections = changed("lattice", "cells_x", 4)
    assert nearest_fit(sections, 1.0, "chambers", "wall_mm") is None
    assert nearest_fit(sections, 1.0, "lattice", "kind") is None


def test_the_cell_drives_the_bladder_and_the_bladder_the_cell():
    assert tied({"cell_mm": 13.0}) == {"cell_mm": 13.0, "bladder_diameter_mm": 26.0}
    assert tied({"bladder_diameter_mm": 26.0}) == {"cell_mm": 13.0, "bladder_diameter_mm": 26.0}
    assert tied({"wall_mm": 1.0}) == {"wall_mm": 1.0}


def test_every_fault_has_a_repair_in_round_numbers_and_together_they_make_a_unit():
    sections = changed("chambers", "neck_diameter_mm", 30.0)
    sections["lattice"] = attrs.evolve(sections["lattice"], cells_x=4)
    sections["waveguide"] = attrs.evolve(sections["waveguide"], well_width_mm=4.0)
    found = repairs(sections, 1.0)
    assert [(r.section, r.name, r.value) for r in found] == [
        ("chambers", "neck_diameter_mm", 24.0),
        ("lattice", "cells_x", 3),
        ("waveguide", "well_width_mm", 3.0),
    ]
    assert "odd count: 3 or 5" in found[1].error.remedy
    for repair in found:
        own = attrs.evolve(sections[repair.section], **tied({repair.name: repair.value}))
        sections[repair.section] = own
    Unit(**sections)
    assert repairs(sections, 1.0) == []


def test_a_rule_that_no_value_of_its_parameter_mends_ends_the_list():
    (last,) = repairs(changed("grading", "cells", "0 3 1: 0.9"), 1.0)
    assert last.value is None
    assert "lie outside" in last.error.what
