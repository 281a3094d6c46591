"""The design's steps: made once, again only where what they take has changed, and honest when muted."""

from collections import Counter

import attrs
import numpy as np
import pytest

from mu_addon.design import steps
from mu_addon.design.anchors import window
from mu_addon.design.dimensions import Dimensions
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import SECTIONS, Unit, load_preset
from mu_addon.design.quantity import describe
from mu_addon.design.steps import STEPS, Stack, StepInputs, downstream
from mu_addon.errors import InputError

UNIT = load_preset("mu-1.0x")
DRAWN = ("membranes", "struts", "anchors", "wells")


def changed(unit, **values):
    """The unit with parameters `section__name=value`."""
    for path, value in values.items():
        section, name = path.split("__")
        unit = attrs.evolve(unit, **{section: attrs.evolve(getattr(unit, section), **{name: value})})
    return unit


def draw(stack, given):
    """Steps that were made for what a preview shows."""
    before = Counter(stack.counts)
    for name in DRAWN:
        stack.value(name, given)
    return {name for name in STEPS if stack.counts[name] > before[name]}


@pytest.fixture
def stack():
    made = Stack()
    draw(made, StepInputs(UNIT, "alpha4"))
    return made


def test_each_step_is_made_once(stack):
    assert stack.counts == Counter(dict.fromkeys([name for name in STEPS if name != "solid"], 1))
    assert draw(stack, StepInputs(UNIT, "alpha4")) == set()


@pytest.mark.parametrize(
    ("parameters", "made"),
    [
        ({"chambers__wall_mm": 1.0}, {"chambers", "membranes", "wells"}),  # no well reaches the cavity
        ({"chambers__inlet_length_mm": 7.0}, {"membranes"}),
        ({"lattice__cells_y_plus": 3}, {"cells", "trim", "grading", "struts", "anchors", "path", "wells"}),
        (
            {"lattice__midspan_diameter_mm": 2.1},
            {"struts", "wells"},
        ),  # struts' roots decide where wells lie open
        ({"grading__tip": 0.9, "grading__cells": "1 * 2: 1.1"}, {"grading", "struts", "wells"}),
        ({"waveguide__row": -1, "waveguide__well_depth_mm": 0.5}, {"anchors", "path", "wells"}),
        ({"waveguide__end_mm": 2.0}, {"path", "wells"}),
        ({"waveguide__well_pitch_mm": 4.0}, {"wells"}),
        ({"chambers__neck_diameter_mm": 12.0}, set(STEPS) - {"solid"}),
        ({"material__membrane_modulus_kPa": 2000.0, "print__offset_xy_mm": 0.1}, set()),
    ],
)
def test_only_what_depends_on_a_parameter_is_made_again(stack, parameters, made):
    assert draw(stack, StepInputs(changed(UNIT, **parameters), "alpha4")) == made
    # Back again, as by undo: everything is still there.
    assert draw(stack, StepInputs(UNIT, "alpha4")) == set()


def test_another_path_makes_path_and_wells_again(stack):
    assert draw(stack, StepInputs(UNIT, "alpha5")) == {"path", "wells"}
    assert downstream("anchors") == ("path", "wells", "solid")


def test_old_values_are_let_go(stack):
    for count in range(steps.KEPT + 1):
        draw(stack, StepInputs(changed(UNIT, chambers__wall_mm=1.0 + 0.01 * count), "alpha4"))
    assert draw(stack, StepInputs(UNIT, "alpha4")) == {"chambers", "membranes", "wells"}


def test_every_parameter_of_the_geometry_belongs_to_one_step():
    owned = Counter(path for step in STEPS.values() for path in step.own)
    assert set(owned.values()) == {1}
    geometry = [s for s in SECTIONS if s.section not in ("print", "material", "wall")]
    assert set(owned) == {f"{s.section}.{d.name}" for s in geometry for d in describe(s)}


def test_a_step_reads_nothing_that_is_not_in_its_key(monkeypatch):
    """Every length that a step looks at belongs to parameters of its own, that it names, or upstream."""
    reads: dict[str, set[str]] = {}
    current = []

    class Watched(Dimensions):
        def __getattribute__(self, name):
            if current and name in fields:
                reads[current[-1]].add(name)
            return super().__getattribute__(name)

    fields = {f.name for f in attrs.fields(Dimensions)}
    plain = UNIT.dimensions
    watched = Watched(**{name: getattr(plain, name) for name in fields})
    monkeypatch.setattr(Unit, "dimensions", property(lambda self: watched))

    def watch(step):
        def make(*values):
            reads[step.name] = set()
            current.append(step.name)
            try:
                return step.make(*values)
            finally:
                current.pop()

        return attrs.evolve(step, make=make)

    monkeypatch.setattr(steps, "STEPS", {name: watch(step) for name, step in STEPS.items()})
    Stack().value("solid", StepInputs(UNIT, "alpha4"))
    monkeypatch.undo()
    assert set(reads) == set(STEPS)

    def moves(path):
        """Lengths that follow one parameter, found by changing it."""
        section, name = path.split(".")
        (d,) = (d for s in SECTIONS if s.section == section for d in describe(s) if d.name == name)
        value = getattr(getattr(UNIT, section), name)
        other = {bool: not value if d.type is bool else None, int: value, str: value}.get(d.type, value)
        if d.type is float:
            other = value * 1.001
        elif d.type is int:
            other = value + 2
        elif d.type is str and not d.choices:
            other = {"cells": "0 1 1: 0.9", "wall_factors": "1: 0.9", "struts": "0 0 0 to 1 1 1"}[name]
        elif d.type is str:
            other = next(c for c in d.choices if c != value)
        bare = attrs.evolve(getattr(UNIT, section), **{name: other})
        unit = object.__new__(Unit)  # rules aside: only which lengths move is asked
        for f in attrs.fields(Unit):
            object.__setattr__(unit, f.name, bare if f.name == section else getattr(UNIT, f.name))
        return {f for f in fields if getattr(unit.dimensions, f) != getattr(plain, f)}

    everything = {f"{s.section}.{d.name}" for s in SECTIONS for d in describe(s)}
    follows = {path: moves(path) for path in everything}
    for name, step in STEPS.items():
        before = [s for s in STEPS if name in downstream(s)]
        known = {*step.own, *step.reads, *(p for s in before for p in (*STEPS[s].own, *STEPS[s].reads))}
        missed = {p for p in everything - known if follows[p] & reads[name]}
        assert not missed, f"{name} reads what follows {sorted(missed)}"


def test_values_are_the_cores(stack):
    given = StepInputs(UNIT, "alpha4")
    struts = stack.value("struts", given)
    whole = lattice_of(UNIT.dimensions)
    assert np.array_equal(struts.lattice.nodes, whole.nodes)
    assert struts.lattice.radius(0.5) == whole.radius(0.5)
    trimmed = stack.value("trim", given)
    d = UNIT.dimensions
    cut = (trimmed.first > 0) | (trimmed.last < 1)
    assert 0 < cut.sum() < len(cut) <= len(whole.struts)
    # Where a strut was cut, its end lies at the actuator, at most one step of the search away.
    first = steps.along(trimmed.ends, trimmed.first[:, None])[:, 0][trimmed.first > 0]
    from mu_addon.design.profile import outer_radius

    gap = np.hypot(first[:, 0], first[:, 1]) - outer_radius(d, first[:, 2])
    assert gap.min() >= 0
    assert gap.max() < 0.05 * d.cell
    assert stack.value("path", given).window == window(UNIT, "alpha4")


def test_muted_steps_pass_on_what_they_would_change():
    stack = Stack()

    def value(name, *muted, path="alpha4"):
        return stack.value(name, StepInputs(UNIT, path, muted))

    whole = lattice_of(UNIT.dimensions)
    assert value("membranes", "chambers").cavity is None
    assert value("membranes", "membranes") is None
    untrimmed = value("trim", "trim")
    assert len(untrimmed.ends) == len(whole.struts)
    assert not untrimmed.first.any()
    assert untrimmed.last.all()
    assert value("struts", "struts").lattice is None
    assert value("struts", "cells") is None
    assert value("path", "anchors") is None
    assert value("wells", "path") is None
    assert len(value("wells").wells) > 0
    assert len(value("wells", "wells").wells) == 0
    assert np.array_equal(value("wells").legs, value("wells", "wells").legs)
    # Unmuted again, nothing is made anew.
    before = Counter(stack.counts)
    value("wells")
    assert stack.counts == before


@pytest.mark.parametrize(
    "name", ["chambers", "membranes", "cells", "trim", "grading", "struts", "anchors", "wells"]
)
def test_no_solid_is_built_without_what_it_needs(name):
    with pytest.raises(InputError, match=f"without {name} is not the unit") as error:
        Stack().value("solid", StepInputs(UNIT, "alpha4", {name}))
    assert name in error.value.remedy


def test_a_muted_path_gives_the_solid_without_a_waveguide():
    unit = changed(UNIT, chambers__count=3, waveguide__row=2)
    stack = Stack()
    with_path = stack.value("solid", StepInputs(unit, "alpha1"))
    without = stack.value("solid", StepInputs(unit, "alpha1", {"path"}))
    assert (with_path.window.name, without.window) == ("alpha1", None)
    # Anchors and wells serve the path alone.
    assert stack.value("solid", StepInputs(unit, "", {"anchors", "wells"})).gates.volume_mm3 == (
        without.gates.volume_mm3
    )
    assert stack.value("solid", StepInputs(unit, "alpha1")) is with_path


@pytest.mark.parametrize("name", ["profile", "solid"])
def test_what_everything_is_made_from_cannot_be_muted(name):
    with pytest.raises(InputError, match="cannot be muted"):
        StepInputs(UNIT, "", {name})


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match="no step 'polish'"):
        StepInputs(UNIT, "", {"polish"})
    with pytest.raises(InputError, match="no step 'polish'"):
        Stack().value("polish", StepInputs(UNIT))
    with pytest.raises(InputError, match="no path 'alpha99'"):
        Stack().value("wells", StepInputs(UNIT, "alpha99"))
