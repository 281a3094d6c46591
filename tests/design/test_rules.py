import ast
import inspect
import re

import pytest
from hypothesis import given, settings

from mu_addon.design import rules
from mu_addon.design.grading import Grading
from mu_addon.design.parameters import Chambers, Envelope, Unit, Waveguide
from mu_addon.errors import InputError

from .units import units

APEX = "a cavity within every wall"
BROKEN = [
    ("node-apex alignment", "bladder_diameter_mm", {"chambers": Chambers(bladder_diameter_mm=24.0)}),
    ("node-apex alignment", "bladder_diameter_mm", {"chambers": Chambers(cell_mm=10.0)}),
    ("bladder and neck", "neck_diameter_mm", {"chambers": Chambers(neck_diameter_mm=25.0)}),
    ("bending plane through cell centres", "cells_x", {"lattice": Envelope(cells_x=4)}),
    ("lattice wider toward +y", "cells_y_plus", {"lattice": Envelope(cells_y_minus=2, cells_y_plus=1)}),
    ("lattice wider toward +y", "cells_y_plus", {"lattice": Envelope(cells_y_minus=1, cells_y_plus=1)}),
    (APEX, "wall_mm", {"chambers": Chambers(wall_mm=1.9)}),
    (APEX, "wall_mm", {"chambers": Chambers(wall_mm=1.9), "scale": 1.5}),
    ("a bore through every neck", "wall_mm", {"chambers": Chambers(neck_diameter_mm=2.0, wall_mm=1.0)}),
    ("a cavity in every chamber", "base_cap_mm", {"chambers": Chambers(base_cap_mm=6.25)}),
    ("a cavity in every chamber", "tip_cap_mm", {"chambers": Chambers(tip_cap_mm=7.0), "scale": 0.75}),
    ("inlet within the neck's bore", "inlet_diameter_mm", {"chambers": Chambers(inlet_diameter_mm=11.3)}),
    ("inlet boss on the base", "inlet_wall_mm", {"chambers": Chambers(inlet_wall_mm=4.3), "scale": 0.75}),
    ("struts narrow at junctions", "midspan_diameter_mm", {"lattice": Envelope(midspan_diameter_mm=1.4)}),
    ("open cells", "midspan_diameter_mm", {"lattice": Envelope(midspan_diameter_mm=8.9)}),
    (
        "open cells",
        "base, lower",
        {"lattice": Envelope(midspan_diameter_mm=5.0), "grading": Grading(base=1.9, lower=1.8)},
    ),
    ("graded cells within the lattice", "cells", {"grading": Grading(cells="0 3 1: 0.9")}),
    ("graded cells within the lattice", "cells", {"grading": Grading(cells="* * 7: 0.9"), "scale": 0.75}),
    (
        "struts of some thickness",
        "base, minus_y, cells",
        {"grading": Grading(base=0.5, minus_y=0.5, cells="0 -1 1: 0.5"), "scale": 0.75},
    ),
    ("anchors are lattice nodes outside the cavity", "row", {"waveguide": Waveguide(row=0)}),
    ("anchors are lattice nodes outside the cavity", "row", {"waveguide": Waveguide(row=3)}),
    ("anchors are lattice nodes outside the cavity", "row", {"waveguide": Waveguide(row=-2)}),
    ("waveguide inside the lattice", "section_mm", {"waveguide": Waveguide(section_mm=4.0), "scale": 0.3}),
    ("waveguide inside the lattice", "end_mm", {"waveguide": Waveguide(end_mm=4.7), "scale": 0.75}),
    ("wells within the waveguide", "well_depth_mm", {"waveguide": Waveguide(well_depth_mm=1.5)}),
    ("wells clear of the membrane", "well_depth_mm", {"waveguide": Waveguide(row=1, well_depth_mm=0.8)}),
    ("separate wells", "well_width_mm", {"waveguide": Waveguide(well_width_mm=3.125)}),
    (
        "inclusion within its cells",
        "inclusion_radius_mm",
        {"waveguide": Waveguide(inclusion_radius_mm=2.0, end_mm=0.0), "scale": 0.3},
    ),
]
# The number in the remedy must itself be accepted, and a hundredth more refused.
OFFERED = [
    ("chambers", Chambers, "wall_mm", 5.0, {}),
    (
        "chambers",
        Chambers,
        "wall_mm",
        1.0,
        {"neck_diameter_mm": 1.9, "inlet_diameter_mm": 0.5, "inlet_wall_mm": 0.2},
    ),
    ("chambers", Chambers, "base_cap_mm", 9.0, {}),
    ("chambers", Chambers, "tip_cap_mm", 9.0, {}),
    ("chambers", Chambers, "inlet_diameter_mm", 20.0, {"inlet_wall_mm": 0.2}),
    ("chambers", Chambers, "inlet_wall_mm", 9.0, {}),
    ("lattice", Envelope, "midspan_diameter_mm", 12.0, {}),
    ("waveguide", Waveguide, "end_mm", 19.0, {}),
]


@pytest.mark.parametrize(("rule", "key", "change"), BROKEN)
def test_a_broken_rule_is_named(rule, key, change):
    with pytest.raises(InputError) as caught:
        Unit(**change)
    assert f"(rule: {rule})" in caught.value.what
    assert caught.value.where.endswith(f"] {key}")
    assert caught.value.remedy


def test_every_rule_is_tested():
    tree = ast.parse(inspect.getsource(rules))
    named = {
        call.args[0].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and getattr(call.func, "id", "") == "_refuse"
        and isinstance(call.args[0], ast.Constant)
    }
    assert len(named) > 10
    elsewhere = {"bending plane is a mirror plane of the lattice"}  # with its kind, in test_lattice_kinds
    assert named | {APEX, "a bore through every neck"} == {rule for rule, _, _ in BROKEN} | elsewhere


@pytest.mark.parametrize("scale", [0.75, 1.0, 1.3])
@pytest.mark.parametrize(("name", "section", "key", "value", "rest"), OFFERED)
def test_the_offered_value_fits_and_a_larger_one_does_not(name, section, key, value, rest, scale):
    with pytest.raises(InputError) as caught:
        Unit(scale=scale, **{name: section(**{key: value}, **rest)})
    offered = float(re.search(r" is ([\d.]+) mm", caught.value.remedy)[1])
    assert offered < value
    Unit(scale=scale, **{name: section(**{key: offered}, **rest)})
    with pytest.raises(InputError, match="rule: "):
        Unit(scale=scale, **{name: section(**{key: offered + 0.01}, **rest)})


def test_the_wall_limit_is_the_curvature_radius():
    with pytest.raises(InputError) as caught:
        Unit(chambers=Chambers(wall_mm=3.0))
    assert caught.value.remedy == "the largest wall that fits is 1.874 mm"
    assert Unit().dimensions.apex_curvature_radius == 1.875


def test_a_symmetric_envelope_can_be_asked_for():
    assert Unit(
        lattice=Envelope(cells_y_plus=1, allow_symmetric=True), waveguide=Waveguide(row=1)
    ).dimensions.bounds[1] == (
        -18.75,
        18.75,
    )
    with pytest.raises(InputError, match="the other way"):
        Unit(lattice=Envelope(cells_y_minus=2, cells_y_plus=1, allow_symmetric=True))


@given(units())
@settings(max_examples=60)
def test_units_drawn_for_the_properties_keep_every_rule(unit):
    rules.check(unit.dimensions, unit.lattice.allow_symmetric)
