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
    presets,
    require_out,
    unit_if_named,
)

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.study import Input, Study
    from .options import Commands


def _add_unit(command: argparse.ArgumentParser, one: Any) -> None:
    add_unit(command, one.needed and not one.default, results=False)
    if one.needed and not one.default:
        add_model(command)


def _unit(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    if one.needed and not one.default:
        return modelled_unit(options, context)
    from ..design.parameters import load_preset

    found = unit_if_named(options)
    return load_preset(one.default) if found is None and one.default else found


def _add_measured(command: argparse.ArgumentParser, one: Any) -> None:
    add_measured_folder(command, one.text)


def _measured(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    from ..measured import read_folder

    return read_folder(Path(options.folder))


def _add_gripper(command: argparse.ArgumentParser, one: Any) -> None:
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--preset", metavar="NAME", help=f"Gripper preset: {presets('gripper')}.")
    which.add_argument("--gripper", metavar="FILE", help="Gripper parameters, a TOML file.")


def _gripper(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    from ..design.gripper import load_gripper, read_gripper

    return load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)


def _add_bending(command: argparse.ArgumentParser, one: Any) -> None:
    words = "Recordings, or folders of measured data of the kind waveguide_bending."
    command.add_argument("data", nargs="+", metavar="FOLDER", help=words)


def _bending(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    return tuple(map(Path, options.data))


def _add_file(command: argparse.ArgumentParser, one: Any) -> None:
    command.add_argument("file", metavar="FILE", help=one.text)


def _design(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    from ..optimization import read_design

    return read_design(Path(options.file))


def _plan(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    from ..usecases.parameter_study.plan import read_plan

    return read_plan(Path(options.file)).continued(Path(options.out) / "sweep.toml", options.add)


def _add_model(command: argparse.ArgumentParser, one: Any) -> None:
    add_model(command, one.text)


def _model(options: argparse.Namespace, context: RunContext, one: Any) -> Any:
    from ..evidence import load_model

    return None if options.model is None else load_model(Path(options.model))


OBJECTS = {
    "unit": (_add_unit, _unit),
    "gripper": (_add_gripper, _gripper),
    "measured": (_add_measured, _measured),
    "bending": (_add_bending, _bending),
    "design": (_add_file, _design),
    "model": (_add_model, _model),
    "plan": (_add_file, _plan),
}
"""By kind of an input that is no plain value: its options are added, its value made of them."""


def command_of(name: str) -> tuple[Callable[[Any], None], Callable[[Any, Any], None]]:
    """What adds the subcommand of a study, and what starts it."""
    kind = study(name)
    return lambda commands: _add(commands, kind), lambda options, context: _run(kind, options, context)


def _add(commands: Commands[Any], kind: type[Study]) -> None:
    words = " ".join(inspect.getdoc(kind).split("\n\n")[0].split())  # type: ignore[union-attr]
    command = commands.add_parser(kind.name, help=words, epilog=f"example: run.py {kind.example}")
    if kind.from_file[0]:
        command.add_argument("file", metavar="FILE", help=kind.from_file[0])
    for one in kind.inputs().values():
        if one.descriptions:
            _add_values(command, one)
            if kind.from_file[0]:
                command.set_defaults(**{_dest(one): None})
        elif one.kind in OBJECTS:
            OBJECTS[one.kind][0](command, one)
    add_results(command)
    add_report(command)


def _dest(one: Input) -> str:
    """Name of an input's value among the options."""
    return one.option if len(one.descriptions) > 1 else one.descriptions[0].name


def _add_values(command: argparse.ArgumentParser, one: Input) -> None:
    """The option of an input's plain values."""
    first = one.descriptions[0]
    if len(one.descriptions) == 1:
        add_setting(command, first, one.metavar, one.many, one.alone, one.option)
        return
    defaults = [d.default for d in one.descriptions]
    shown = " ".join(f"{value:g}" for value in defaults)
    command.add_argument(
        f"--{one.option}",
        nargs=len(defaults),
        type=first.type,
        default=defaults,
        metavar=one.metavar,
        help=f"{first.text[:1].upper()}{first.text[1:]} (default: {shown}).",
    )


def _run(kind: type[Study], options: argparse.Namespace, context: RunContext) -> None:
    from ..studies.use_case import use_case

    require_out(options)
    values: dict[str, Any] = {}
    for name, one in kind.inputs().items():
        if one.descriptions:
            given = getattr(options, _dest(one))
            if given is None and kind.from_file[0]:
                continue
            given = one.descriptions[0].default if given is None else given
            values[name] = one.made(tuple(given) if len(one.descriptions) > 1 else (given,), values)
        elif one.kind in OBJECTS:
            values[name] = OBJECTS[one.kind][1](options, context, one)
    if kind.from_file[0]:
        study = kind.read_file(Path(options.file), (kind.name, kind.from_file[1]), values)
    else:
        study = kind(**values).complete()
    use_case(kind.name).start(study, Path(options.out), context)
