"""Nodes of the design: one for each step of the core, from its definition, and those that make units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import attrs

from ..design.anchors import window
from ..design.lattice import Graph
from ..design.parameters import from_toml, load_preset, preset_names, read_unit
from ..design.settings import PRESET, QUALITY
from ..design.steps import STEPS, Path, Stack, Step, Struts, TrimmedStruts
from ..design.waveguide import Bar
from ..errors import InputError
from ..graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, node, setting
from ..graph.evaluation import Order
from ..studies.unit_ranking import UnitStudy
from .parts import (
    SCALE,
    Design,
    Part,
    blamed,
    described,
    first_choosing,
    known_path,
    part_of,
    rest,
    solid_of,
    whole_unit,
)

STACK = Stack()
"""Values of the steps of every tree in this process."""
DESIGN, UNIT = "Design", "Unit"
_PATH = setting("path", "", "path of the waveguide, alpha1 and on; empty: none")
# Fields of `StepInputs`, set at the first step that depends on them.
_CHOSEN = {
    "path": _PATH,
    "quality": Setting(QUALITY),
    "body": setting(
        "body", "", "closed surface that the lattice fills in place of its box: STL, OBJ or PLY", path=FILE
    ),
}


def _ancestors(names: Iterable[str]) -> set[str]:
    found: set[str] = set()
    for name in names:
        found |= {name} | _ancestors(STEPS[name].after)
    return found


def _sources(step: Step) -> tuple[str, ...]:
    """Steps that a step's node is linked to: those before it, and those whose parameters it also reads.

    A part that passes through another step is linked once.
    """
    known = _ancestors(step.after)
    more = [
        other.name
        for other in STEPS.values()
        if other.name not in known and other.name != step.name and set(other.own) & set(step.reads)
    ]
    through = {name for other in more for name in _ancestors(STEPS[other].after)}
    return (*step.after, *(name for name in more if name not in through))


def _needs_path(name: str) -> bool:
    """Return True if a step needs a waveguide."""
    return first_choosing("path") in _ancestors([name])


def _may_lack(step: Step, name: str) -> bool:
    """Return True if a step can do without this source, because only the waveguide's parts need it."""
    return _needs_path(name) and not all(map(_needs_path, step.after))


def _settings(step: Step) -> tuple[Setting, ...]:
    own = [Setting(described()[path]) for path in step.own]
    # The scale is of every length, so it is set where the first of them are.
    scale = [] if step.after else [Setting(SCALE)]
    chosen = [_CHOSEN[name] for name in step.chosen if first_choosing(name) == step.name]
    return (*chosen, *own, *scale)


def _of_step(step: Step) -> Definition:
    """Node of a step of the core."""
    inputs = tuple(
        Input(
            name,
            (STEPS[name].gives,),
            f"link the output {name} of a node {name.capitalize()}",
            only=(name,),
            needed=not _may_lack(step, name),
        )
        for name in _sources(step)
    )

    def make(call: Call) -> Outputs:
        part = part_of(step, call)
        return {step.name: part, "value": _value(part)}

    def order(call: Call) -> Order:
        unit, given, path = solid_of(call)
        job = UnitStudy(unit=unit, stages=("design",), quality=given.quality, body=given.body, path=path)
        return Order(job)

    solid = step.gives == "solid"
    return Definition(
        kind=step.name,
        label=step.name.capitalize(),
        category=DESIGN,
        text=step.text,
        inputs=inputs,
        outputs=(Output(step.name, step.gives, step.text),),
        settings=_settings(step),
        muting=step.muting,
        make=None if solid else make,
        order=order if solid else None,
        read=(lambda call, done: {step.name: done}) if solid else None,
        mute=make if step.muting else None,
        remark=(lambda outputs: _solid_remark(outputs[step.name].summary)) if solid else _remark,
        named=True,
    )


def _value(part: Part) -> Any:
    """Geometry of a part by the core's steps; None if only the whole unit satisfies the rules."""
    try:
        given = part.inputs(part.unit())
        if given.path:
            window(given.unit, given.path)
    except InputError:
        # A rule may be broken only with the defaults of what is not linked yet: the unit's node will say so.
        return None
    return STACK.value(part.step, given)


def _remark(outputs: Outputs) -> str:
    value = outputs["value"]
    if isinstance(value, Graph):
        return f"{len(value.struts)} struts"
    if isinstance(value, TrimmedStruts):
        return f"{len(value.ends)} struts"
    if isinstance(value, Struts):
        return f"{len(value.trimmed.ends)} struts"
    if isinstance(value, Path):
        return f"{len(value.points)} anchors"
    return f"{len(value.wells)} wells" if isinstance(value, Bar) else ""


def _solid_remark(summary: Mapping[str, Any]) -> str:
    volume = ((summary.get("gates") or {}).get("unit.stl") or {}).get("volume_mm3")
    return f"{volume / 1e3:.2f} ml" if isinstance(volume, float) else ""


# The unit: by its steps, from a file, and one of which a parameter is changed.


def unit_remark(outputs: Outputs) -> str:
    """Wall and height of a unit, in mm."""
    d = outputs["unit"].unit.dimensions
    return f"wall {d.wall:.3g} mm, {d.height:.4g} mm long"


def _renamed(path: str) -> Setting:
    """A parameter named with its section, since sections have parameters of the same name."""
    return Setting(described()[path]._replace(name=path.replace(".", "_")))


@node(
    DESIGN,
    tuple(
        Input(
            name,
            (STEPS[name].gives,),
            f"link a node {name.capitalize()}",
            (name,),
            needed=not _may_lack(STEPS["solid"], name),
        )
        for name in STEPS["solid"].after
    ),
    (Output("unit", "unit", "the unit"),),
    (setting("name", "custom", "name of the unit"), *map(_renamed, rest())),
    label="Assemble Unit",
    remark=unit_remark,
    named=True,
)
def assemble(call: Call) -> Outputs:
    """The unit of these parts, with its material, wall law and printer."""
    # As a step that is made from all parts of the solid.
    part = part_of(attrs.evolve(STEPS["solid"], own=(), chosen=()), attrs.evolve(call, muted=False))
    more = {path: call.settings[path.replace(".", "_")] for path in rest()}
    origin = {**part.origin, **dict.fromkeys(more, call.node)}
    unit = whole_unit(attrs.evolve(part, origin=origin), call.node, more, call.settings["name"])
    try:
        given = part.inputs(unit)
        wanted = "" if "path" in part.muted or call.inputs["wells"] is None else given.path
        path = known_path(unit, wanted)
        STACK.value("struts", given)
    except InputError as error:
        raise blamed(error, {**origin, **_chosen_origin(part, origin)}, call.node) from error
    return {"unit": Design(unit, path, given.body, part.muted, origin)}


def _chosen_origin(part: Part, origin: Mapping[str, str]) -> dict[str, str]:
    """Node that has set each chosen input: the one with a parameter of the same step."""
    found = {}
    for name in part.chosen:
        own = STEPS[first_choosing(name)].own
        found[name] = next((origin[path] for path in own if path in origin), "")
    return found


@node(
    UNIT,
    outputs=(Output("unit", "unit", "the unit"),),
    settings=(
        setting("preset", PRESET, "shipped unit", choices=tuple(preset_names())),
        setting("file", "", "TOML file of a unit, in place of the preset", path=FILE),
        _PATH,
        setting("parameters", "", "TOML text of a unit, in place of preset and file", shown=False),
    ),
    remark=unit_remark,
    named=True,
)
def unit(call: Call) -> Outputs:
    """A unit by its preset or its file of parameters."""
    s = call.settings
    if s["parameters"]:
        found = from_toml(s["parameters"], "parameters")
    else:
        found = read_unit(s["file"]) if s["file"] else load_preset(s["preset"])
    origin = dict.fromkeys(described(), call.node)
    return {"unit": Design(found, known_path(found, s["path"]), origin=origin)}


NUMBERS = tuple(path for path, d in described().items() if d.type in (int, float))


@node(
    UNIT,
    (Input("unit", ("unit",), "link a unit"),),
    (Output("unit", "unit", "the changed unit"),),
    (
        setting("parameter", "chambers.wall_mm", "which parameter, by section and name", choices=NUMBERS),
        setting("value", 0.9, "its value, in the parameter's unit", low=-1e6, high=1e6),
    ),
    muting="the unit passes unchanged",
    mute=lambda call: {"unit": call.inputs["unit"]},
    remark=unit_remark,
    named=True,
)
def set_parameter(call: Call) -> Outputs:
    """The unit with another value of one parameter."""
    design: Design = call.inputs["unit"]
    path, value = call.settings["parameter"], call.settings["value"]
    d = described()[path]
    value = Setting(d).checked(value)
    section, _, name = path.rpartition(".")
    if section:
        inner = attrs.evolve(getattr(design.unit, section), **{name: value})
        unit = attrs.evolve(design.unit, **{section: inner})
    else:
        unit = attrs.evolve(design.unit, scale=value)
    return {"unit": attrs.evolve(design, unit=unit, origin={**design.origin, path: call.node})}


def design_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of the design."""
    return *(_of_step(step) for step in STEPS.values()), assemble, unit, set_parameter
