"""The command of a study: options, help and start, from its declaration."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..studies import study
from .options import (
    add_measured_folder,
    add_model,
    add_report,
    add_results,
    add_setting,
    add_unit,
    modelled_unit,
    require_out,
)

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.study import Study
    from .options import Commands


def _add_unit(command: argparse.ArgumentParser) -> None:
    add_unit(command)
    add_model(command)


def _add_measured(command: argparse.ArgumentParser) -> None:
    add_measured_folder(command)
    add_results(command)


def _measured(options: argparse.Namespace, context: RunContext) -> Any:
    from ..measured import read_folder

    require_out(options)
    return read_folder(Path(options.folder))


OBJECTS = {"unit": (_add_unit, modelled_unit), "measured": (_add_measured, _measured)}
"""By kind of an input that is no plain value: its options are added, its value made of them."""


def command_of(name: str) -> tuple[Callable[[Any], None], Callable[[Any, Any], None]]:
    """What adds the subcommand of a study, and what starts it."""
    kind = study(name)
    return lambda commands: _add(commands, kind), lambda options, context: _run(kind, options, context)


def _add(commands: Commands[Any], kind: type[Study]) -> None:
    words = " ".join(inspect.getdoc(kind).split("\n\n")[0].split())  # type: ignore[union-attr]
    command = commands.add_parser(kind.name, help=words, epilog=f"example: run.py {kind.example}")
    for one in kind.inputs().values():
        if one.description is not None:
            add_setting(command, one.description, one.metavar, one.many)
        else:
            OBJECTS[one.kind][0](command)
    add_report(command)


def _run(kind: type[Study], options: argparse.Namespace, context: RunContext) -> None:
    from ..studies.use_case import use_case

    values: dict[str, Any] = {}
    for name, one in kind.inputs().items():
        if one.description is not None:
            values[name] = one.made(getattr(options, name), values)
        else:
            values[name] = OBJECTS[one.kind][1](options, context)
    use_case(kind.name).start(kind(**values), Path(options.out), context)
