"""The command of a study: options, help and start, from its declaration."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..studies import study
from .objects import OBJECTS
from .options import add_results, add_setting, require_out, sentence

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.study import Input, Study
    from .options import Commands


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
        if one.title not in groups:
            groups[one.title] = command.add_argument_group(one.title)
        if one.descriptions:
            _add_values(groups[one.title], one)
            if kind.from_file[0]:
                command.set_defaults(**{_dest(one): None})
        elif one.kind in OBJECTS:
            OBJECTS[one.kind][0](groups[one.title], one)
    add_results(command)
    if not kind.joins:
        words = "Compute the numbers only: no pictures, no report.html."
        command.add_argument("--no-report", dest="report", action="store_false", help=words)


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
