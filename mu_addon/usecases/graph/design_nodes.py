"""Nodes of the design: one for each step of the core, made from its definition, and what makes units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

import attrs

from ...design.anchors import window
from ...design.body import Body, envelope, read_body
from ...design.lattice import Graph
from ...design.parameters import SECTIONS, Unit, from_toml, load_preset, preset_names, read_unit
from ...design.quantity import Description, describe
from ...design.solid import QUALITY
from ...design.steps import STEPS, Path, Stack, Step, StepInputs, Struts, TrimmedStruts, require_whole
from ...design.waveguide import Bar
from ...errors import InputError
from ...graph.definition import FILE, Call, Definition, Input, Output, Outputs, Setting, setting
from ...graph.evaluation import NodeError

STACK = Stack()
"""Values of the steps of every tree in this process."""
DESIGN, UNIT = "Design", "Unit"
BOTH = "both"
# Fields of `StepInputs` that are set at the first step which depends on them.
_CHOSEN = {
    "path": setting("path", "", "path of the waveguide, alpha1 and on; empty: none"),
    "quality": setting(
        "quality", "interactive", "how fine the facets of the solid are", choices=tuple(QUALITY)
    ),
    "body": setting(
        "body", "", "closed surface that the lattice fills in place of its box: STL, OBJ or PLY", path=FILE
    ),
}
_SCALE = next(d for d in describe(Unit) if d.name == "scale")


@attrs.frozen
class Part:
    """What steps have made so far: their parameters, by `section.name`, and which node each is from.

    chosen: of `StepInputs`, by name; muted: names of muted steps; step: the last of them.
    """

    step: str
    parameters: Mapping[str, Any]
    chosen: Mapping[str, str]
    muted: frozenset[str]
    origin: Mapping[str, str]

    def unit(self, name: str = "custom", more: Mapping[str, Any] | None = None) -> Unit:
        """The unit with these parameters, all others at their defaults; raises InputError by a rule."""
        values = {**self.parameters, **(more or {})}
        return Unit(name=name, scale=values.get("scale", 1.0), **_sections(values))

    def inputs(self, unit: Unit) -> StepInputs:
        """What the steps make a unit from. Raises InputError for a body that does not fit."""
        body = body_in(self.chosen.get("body", ""), unit)
        quality = self.chosen.get("quality", "interactive")
        return StepInputs(unit, self.chosen.get("path", ""), self.muted, quality, body)  # type: ignore[arg-type]


@attrs.frozen(eq=False)
class Design:
    """A whole unit: its parameters, the path of its waveguide or "", its body in place of the lattice's box.

    origin: which node a parameter is from, by `section.name`.
    """

    unit: Unit
    path: str = ""
    body: Body | None = None
    muted: frozenset[str] = frozenset()
    origin: Mapping[str, str] = attrs.field(factory=dict)


def body_in(path: str, unit: Unit) -> Body | None:
    """The body in a file, cut to the unit's length, or None without one; raises InputError."""
    return envelope(read_body(path), unit.dimensions) if path else None


def _sections(values: Mapping[str, Any]) -> dict[str, Any]:
    """A unit's sections with the values that are given by `section.name`."""
    found: dict[str, Any] = {}
    for section in SECTIONS:
        own = _name_of(section)
        given = {d.name: values[f"{own}.{d.name}"] for d in describe(section) if f"{own}.{d.name}" in values}
        found[own] = section(**given)
    return found


def _name_of(section: Any) -> str:
    return str(section.section)


@cache
def _described() -> dict[str, Description]:
    """Every parameter of a unit by `section.name`, the scale by its own name."""
    found = {f"{_name_of(s)}.{d.name}": d for s in SECTIONS for d in describe(s)}
    return {"scale": _SCALE, **found}


def _ancestors(names: Iterable[str]) -> set[str]:
    found: set[str] = set()
    for name in names:
        found |= {name} | _ancestors(STEPS[name].after)
    return found


def _sources(step: Step) -> tuple[str, ...]:
    """Steps that a step's node is linked to: those before it, and those whose parameters it reads besides."""
    known = _ancestors(step.after)
    more = [
        other.name
        for other in STEPS.values()
        if other.name not in known and other.name != step.name and set(other.own) & set(step.reads)
    ]
    return (*step.after, *more)


def _first_choosing(name: str) -> str:
    return next(step.name for step in STEPS.values() if name in step.chosen)


def _needs_path(name: str) -> bool:
    """Whether a step makes nothing of a unit without a waveguide."""
    return _first_choosing("path") in _ancestors([name])


def _may_lack(step: Step, name: str) -> bool:
    """Whether a step does without this source: what is made of other parts, too, does without a waveguide."""
    return _needs_path(name) and not all(map(_needs_path, step.after))


def _settings(step: Step) -> tuple[Setting, ...]:
    own = [Setting(_described()[path]) for path in step.own]
    # The scale is of every length, so it is set where the first of them are.
    scale = [] if step.after else [Setting(_SCALE)]
    chosen = [_CHOSEN[name] for name in step.chosen if _first_choosing(name) == step.name]
    return (*chosen, *own, *scale)


def _of_step(step: Step) -> Definition:
    """The node of a step of the core."""
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

    def part_of(call: Call) -> Part:
        return _part(step, call)

    def make(call: Call) -> Outputs:
        part = part_of(call)
        return {step.name: part, "value": _value(part)}

    def order(call: Call) -> Any:
        # Loads the solver, as every run does.
        from .orders import solid_order

        return solid_order(call)

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


def _part(step: Step, call: Call) -> Part:
    """What the linked parts and the node's own settings come to; InputError where two parts differ."""
    parameters: dict[str, Any] = {}
    chosen: dict[str, str] = {}
    origin: dict[str, str] = {}
    muted: set[str] = set()
    for name, part in call.inputs.items():
        if part is None:
            continue
        for path, value in part.parameters.items():
            if path in parameters and parameters[path] != value:
                raise InputError(
                    f"the inputs are parts of two designs: {path} is {parameters[path]!r} by "
                    f"{origin[path]!r} and {value!r} by {part.origin[path]!r}",
                    name,
                    "link parts that were made from the same nodes",
                )
            parameters[path], origin[path] = value, part.origin[path]
        chosen |= part.chosen
        muted |= part.muted
    for path in step.own:
        parameters[path], origin[path] = call.settings[path.split(".")[1]], call.node
    if not step.after:
        parameters["scale"], origin["scale"] = call.settings["scale"], call.node
    chosen |= {name: call.settings[name] for name in step.chosen if name in call.settings}
    return Part(
        step.name, parameters, chosen, frozenset(muted | ({step.name} if call.muted else set())), origin
    )


def _value(part: Part) -> Any:
    """Geometry of a part by the core's steps; None where only the whole unit keeps the rules."""
    try:
        given = part.inputs(part.unit())
        if given.path:
            window(given.unit, given.path)
    except InputError:
        # A rule may be broken only with the defaults of what is not linked yet: the unit's node will say so.
        return None
    return STACK.value(part.step, given)


def _whole(part: Part, node: str, more: Mapping[str, Any], name: str = "custom") -> Unit:
    """The part's unit; an error by a rule is that of the node whose parameter breaks it."""
    try:
        return part.unit(name, more)
    except InputError as error:
        raise _blamed(error, part.origin, node) from error


def _blamed(error: InputError, origin: Mapping[str, str], node: str) -> NodeError:
    """The error with the node that set the first parameter which it names."""
    words = error.where.replace("[", "").replace("]", "").replace(",", " ").split()
    section = words[0] if len(words) > 1 else ""
    for word in words:
        cause = origin.get(word) or origin.get(f"{section}.{word}")
        if cause:
            return NodeError(error, cause)
    return NodeError(error, node)


def solid_of(call: Call) -> tuple[Unit, StepInputs, str]:
    """Unit, steps' inputs and path of the node Solid; InputError where a step that it needs is muted."""
    part = _part(STEPS["solid"], call)
    unit = _whole(part, call.node, {})
    given = part.inputs(unit)
    require_whole(given)
    path = "" if "path" in given.muted or call.inputs.get("wells") is None else given.path
    return unit, given, _known(unit, path)


def refuse_body(design: Design, what: str) -> None:
    """Raise InputError for a unit with a body in place of the lattice's box."""
    if design.body is not None:
        raise InputError(f"{what} knows no body in place of the lattice's box", "unit", "leave the body out")


def _known(unit: Unit, path: str) -> str:
    """The path's name; raises InputError for one that the unit has not."""
    return window(unit, path).name if path else ""


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


def _rest() -> tuple[str, ...]:
    """Parameters that no step owns: of material, wall and printer."""
    owned = {path for step in STEPS.values() for path in step.own}
    return tuple(path for path in _described() if path not in owned and path != "scale")


def _assembled(call: Call) -> Outputs:
    # As a step that is made from all parts of the solid.
    part = _part(attrs.evolve(STEPS["solid"], own=(), chosen=()), attrs.evolve(call, muted=False))
    more = {path: call.settings[path.replace(".", "_")] for path in _rest()}
    origin = {**part.origin, **dict.fromkeys(more, call.node)}
    unit = _whole(attrs.evolve(part, origin=origin), call.node, more, call.settings["name"])
    try:
        given = part.inputs(unit)
        path = "" if "path" in part.muted or call.inputs.get("wells") is None else _known(unit, given.path)
        STACK.value("struts", given)
    except InputError as error:
        raise _blamed(error, {**origin, **_chosen_origin(part, origin)}, call.node) from error
    return {"unit": Design(unit, path, given.body, part.muted, origin)}


def _chosen_origin(part: Part, origin: Mapping[str, str]) -> dict[str, str]:
    """Which node has set what is chosen: the one with a parameter of the same step."""
    found = {}
    for name in part.chosen:
        own = STEPS[_first_choosing(name)].own
        found[name] = next((origin[path] for path in own if path in origin), "")
    return found


def _read_unit(call: Call) -> Outputs:
    s = call.settings
    if s["parameters"]:
        unit = from_toml(s["parameters"], "parameters")
    else:
        unit = read_unit(s["file"]) if s["file"] else load_preset(s["preset"])
    origin = dict.fromkeys(_described(), call.node)
    return {"unit": Design(unit, _known(unit, s["path"]), origin=origin)}


def _with_parameter(call: Call) -> Outputs:
    design: Design = call.inputs["unit"]
    path, value = call.settings["parameter"], call.settings["value"]
    d = _described()[path]
    value = Setting(d).checked(value)
    section, _, name = path.rpartition(".")
    if section:
        inner = attrs.evolve(getattr(design.unit, section), **{name: value})
        unit = attrs.evolve(design.unit, **{section: inner})
    else:
        unit = attrs.evolve(design.unit, scale=value)
    return {"unit": attrs.evolve(design, unit=unit, origin={**design.origin, path: call.node})}


def unit_remark(outputs: Outputs) -> str:
    """Wall and height of a unit, in mm."""
    d = outputs["unit"].unit.dimensions
    return f"wall {d.wall:.3g} mm, {d.height:.4g} mm long"


def _renamed(path: str) -> Setting:
    """A parameter under the name of its section, too: sections have parameters of the same name."""
    return Setting(_described()[path]._replace(name=path.replace(".", "_")))


def design_nodes() -> tuple[Definition, ...]:
    """Definitions of the nodes of the design."""
    numbers = tuple(path for path, d in _described().items() if d.type in (int, float))
    assembled = tuple(
        Input(
            name,
            (STEPS[name].gives,),
            f"link a node {name.capitalize()}",
            (name,),
            needed=not _may_lack(STEPS["solid"], name),
        )
        for name in STEPS["solid"].after
    )
    return (
        *(_of_step(step) for step in STEPS.values()),
        Definition(
            "assemble",
            "Assemble Unit",
            DESIGN,
            "the unit of these parts, with its material, wall law and printer",
            assembled,
            (Output("unit", "unit", "the unit"),),
            (setting("name", "custom", "name of the unit"), *map(_renamed, _rest())),
            make=_assembled,
            remark=unit_remark,
            named=True,
        ),
        Definition(
            "unit",
            "Unit",
            UNIT,
            "a unit by its preset or its file of parameters",
            outputs=(Output("unit", "unit", "the unit"),),
            settings=(
                setting("preset", "mu-1.0x", "shipped unit", choices=tuple(preset_names())),
                setting("file", "", "TOML file of a unit, in place of the preset", path=FILE),
                setting("path", "", "path of the waveguide, alpha1 and on; empty: none"),
                setting("parameters", "", "TOML text of a unit, in place of preset and file", shown=False),
            ),
            make=_read_unit,
            remark=unit_remark,
            named=True,
        ),
        Definition(
            "set_parameter",
            "Set Parameter",
            UNIT,
            "the unit with another value of one parameter",
            (Input("unit", ("unit",), "link a unit"),),
            (Output("unit", "unit", "the changed unit"),),
            (
                setting(
                    "parameter", "chambers.wall_mm", "which parameter, by section and name", choices=numbers
                ),
                setting("value", 0.9, "its value, in the parameter's unit", low=-1e6, high=1e6),
            ),
            make=_with_parameter,
            muting="the unit passes unchanged",
            mute=lambda call: {"unit": call.inputs["unit"]},
            remark=unit_remark,
            named=True,
        ),
    )
