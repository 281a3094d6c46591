"""Designs passed between nodes: parts with their parameters, and whole units."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import attrs

from ..design.anchors import window
from ..design.body import Body, envelope, read_body
from ..design.parameters import SECTIONS, Unit
from ..design.quantity import Description, describe
from ..design.steps import STEPS, Step, StepInputs, require_whole
from ..errors import InputError
from ..graph.definition import Call
from ..graph.evaluation import NodeError

SCALE = next(d for d in describe(Unit) if d.name == "scale")


@attrs.frozen
class Part:
    """Result of the steps so far: parameters, by `section.name`, and the node each is from.

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
        """Inputs of the steps for a unit. Raises InputError for a body that does not fit."""
        body = body_in(self.chosen.get("body", ""), unit)
        quality = self.chosen.get("quality", "interactive")
        return StepInputs(unit, self.chosen.get("path", ""), self.muted, quality, body)  # type: ignore[arg-type]


@attrs.frozen(eq=False)
class Design:
    """A whole unit: its parameters, the path of its waveguide or "", its body in place of the lattice's box.

    origin: node of each parameter, by `section.name`.
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
    """A unit's sections with the values given by `section.name`."""
    found: dict[str, Any] = {}
    for section in SECTIONS:
        own = _name_of(section)
        given = {d.name: values[f"{own}.{d.name}"] for d in describe(section) if f"{own}.{d.name}" in values}
        found[own] = section(**given)
    return found


def _name_of(section: Any) -> str:
    return str(section.section)


@cache
def described() -> dict[str, Description]:
    """Every parameter of a unit by `section.name`, the scale by its name."""
    found = {f"{_name_of(s)}.{d.name}": d for s in SECTIONS for d in describe(s)}
    return {"scale": SCALE, **found}


def first_choosing(name: str) -> str:
    """Name of the first step that depends on a field of `StepInputs`, where that is set."""
    return next(step.name for step in STEPS.values() if name in step.chosen)


def part_of(step: Step, call: Call) -> Part:
    """Part joined from the linked parts and the node's settings; InputError where two differ."""
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


def whole_unit(part: Part, node: str, more: Mapping[str, Any], name: str = "custom") -> Unit:
    """Unit of the part; an error by a rule is reported at the node whose parameter breaks it."""
    try:
        return part.unit(name, more)
    except InputError as error:
        raise blamed(error, part.origin, node) from error


def blamed(error: InputError, origin: Mapping[str, str], node: str) -> NodeError:
    """The error, assigned to the node that set the first parameter it names."""
    words = error.where.replace("[", "").replace("]", "").replace(",", " ").split()
    section = words[0] if len(words) > 1 else ""
    for word in words:
        cause = origin.get(word) or origin.get(f"{section}.{word}")
        if cause:
            return NodeError(error, cause)
    return NodeError(error, node)


def solid_of(call: Call) -> tuple[Unit, StepInputs, str]:
    """Unit, steps' inputs and path of the node Solid; InputError if a step that it needs is muted."""
    part = part_of(STEPS["solid"], call)
    unit = whole_unit(part, call.node, {})
    given = part.inputs(unit)
    require_whole(given)
    path = "" if "path" in given.muted or call.inputs.get("wells") is None else given.path
    return unit, given, known_path(unit, path)


def refuse_body(design: Design, what: str) -> None:
    """Raise InputError for a unit with a body in place of the lattice's box."""
    if design.body is not None:
        raise InputError(
            f"{what} does not support a body in place of the lattice's box", "unit", "leave the body out"
        )


def known_path(unit: Unit, path: str) -> str:
    """The path's name; raises InputError for one that the unit does not have."""
    return window(unit, path).name if path else ""


def rest() -> tuple[str, ...]:
    """Parameters outside the steps: of material, wall and printer."""
    owned = {path for step in STEPS.values() for path in step.own}
    return tuple(path for path in described() if path not in owned and path != "scale")
