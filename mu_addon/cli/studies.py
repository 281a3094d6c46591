"""The command of a study: options, help and start, from its declaration."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..studies import study
from .options import (
    add_model,
    add_obstacles,
    add_orientation,
    add_report,
    add_results,
    add_setting,
    add_unit,
    modelled,
    presets,
    require_out,
    sentence,
    unit_of,
)

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.study import Input, Study
    from .options import Commands


def _add_unit(command: Any, one: Any) -> None:
    add_unit(command, one.needed and not one.default, results=False)
    if one.modelled and one.needed and not one.default:
        add_model(command)


def _unit(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    if one.modelled and one.needed and not one.default:
        return modelled(options, context, whole=False)[0]
    from ..design.parameters import load_preset

    if options.preset is None and options.unit is None:
        return load_preset(one.default) if one.default else None
    return unit_of(options)


def _add_gripper(command: Any, one: Any) -> None:
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--preset", metavar="NAME", help=f"Gripper preset: {presets('gripper')}.")
    which.add_argument("--gripper", metavar="FILE", help="Gripper parameters, a TOML file.")


def _gripper(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from ..design.gripper import load_gripper, read_gripper

    return load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)


def _add_plan(command: Any, one: Any) -> None:
    command.add_argument("file", metavar="FILE", help=one.text)


def _plan(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from ..studies.parameter_study.plan import read_plan

    return read_plan(Path(options.file)).continued(Path(options.out) / "sweep.toml", options.add)


def _add_effects(command: Any, one: Any) -> None:
    add_model(command)
    add_orientation(command)


def _effects(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    # The model changes the unit's parameters, too.
    values["unit"], effects = modelled(options, context)
    return effects


def _add_obstacles(command: Any, one: Any) -> None:
    add_obstacles(command)


def _obstacles(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    from ..studies.unit_inputs import obstacles_for

    return obstacles_for(values["unit"], options.obstacles, values["body"]) if options.obstacles else ()


def _ask(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from .asking import asker

    return asker(options)


OBJECTS: dict[str, tuple[Callable[..., None], Callable[..., Any]]] = {
    "unit": (_add_unit, _unit),
    "gripper": (_add_gripper, _gripper),
    "effects": (_add_effects, _effects),
    "obstacles": (_add_obstacles, _obstacles),
    "plan": (_add_plan, _plan),
    "ask": (lambda command, one: None, _ask),
}
"""By kind of an input that is no plain value: its options are added, its value made of them."""


def command_of(name: str) -> tuple[Callable[[Any], None], Callable[[Any, Any], None]]:
    """What adds the subcommand of a study, and what starts it."""
    kind = study(name)
    return lambda commands: _add(commands, kind, name), lambda options, context: _run(
        kind, name, options, context
    )


def _targets(kind: type[Study], name: str) -> tuple[str, ...]:
    """Targets of a study's command; "" alone of a study without."""
    return tuple([*kind.commands][: [*kind.commands].index(name) + 1]) if kind.commands else ("",)


def _asked(kind: type[Study], name: str) -> dict[str, Input]:
    """Inputs that a study's command asks for."""
    return {n: one for n, one in kind.inputs().items() if one.target in _targets(kind, name)}


def _add(commands: Commands[Any], kind: type[Study], name: str) -> None:
    words = " ".join(inspect.getdoc(kind).split("\n\n")[0].split())  # type: ignore[union-attr]
    words, example = kind.commands.get(name, (words, kind.example))
    command = commands.add_parser(name, help=words, epilog=f"example: run.py {example}")
    if kind.from_file[0]:
        command.add_argument("file", metavar="FILE", help=kind.from_file[0])
    groups: dict[str, Any] = {"": command}
    for one in _asked(kind, name).values():
        if one.group not in groups:
            groups[one.group] = command.add_argument_group(one.group)
        if one.descriptions:
            _add_values(groups[one.group], one)
            if kind.from_file[0]:
                command.set_defaults(**{_dest(one): None})
        elif one.kind in OBJECTS:
            OBJECTS[one.kind][0](groups[one.group], one)
    add_results(command)
    if not kind.joins:
        add_report(command)


def _dest(one: Input) -> str:
    """Name of an input's value among the options."""
    return one.option if len(one.descriptions) > 1 else one.descriptions[0].name


def _add_values(command: Any, one: Input) -> None:
    """The option of an input's plain values."""
    first = one.descriptions[0]
    if one.argument:
        many: dict[str, Any] = {"nargs": "+"} if one.many else {}
        command.add_argument(first.name, metavar=one.argument, help=sentence(first.text), **many)
        return
    if len(one.descriptions) == 1:
        add_setting(command, first, one=one)
        return
    defaults = [d.default for d in one.descriptions]
    shown = " ".join(f"{value:g}" for value in defaults)
    command.add_argument(
        f"--{one.option}",
        nargs=len(defaults),
        type=first.type,
        default=defaults,
        metavar=one.metavar,
        help=f"{sentence(first.text, '')} (default: {shown}).",
    )


def _run(kind: type[Study], name: str, options: argparse.Namespace, context: RunContext) -> None:
    from ..studies.starting import start

    require_out(options)
    if hasattr(options, "device"):
        from ..fem.device import require_device

        require_device(options.device)
    values: dict[str, Any] = {}
    for field, one in _asked(kind, name).items():
        if one.descriptions:
            given = getattr(options, _dest(one))
            if given is None and kind.from_file[0]:
                continue
            given = one.descriptions[0].default if given is None else given
            values[field] = one.made(tuple(given) if len(one.descriptions) > 1 else (given,), values)
        elif one.kind in OBJECTS:
            values[field] = OBJECTS[one.kind][1](options, context, one, values)
    if kind.commands:
        values["stages"] = _targets(kind, name)
    if kind.from_file[0]:
        study = kind.read_file(Path(options.file), (kind.name, kind.from_file[1]), values)
    else:
        study = kind(**values).complete()
    start(study, Path(options.out), context)
