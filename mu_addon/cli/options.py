"""Options that several subcommands share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..design.quantity import Description
    from ..run.study import Input

# What add_subparsers returns, and what takes an option: argparse gives them no public names.
Commands = argparse._SubParsersAction
Group = argparse._ArgumentGroup | argparse.ArgumentParser


def add_setting(command: Group, d: Description, metavar: Any = None, one: Input | None = None) -> None:
    """Add the option of a setting: its type, choices, default and text; also --no-NAME of a flag that is set.

    one: the study's input that it is, which says how its option differs. Bounds are checked by the job. A
    text that is empty by default is None without the option.
    """
    unit = d.unit.replace("/", "_per_")
    name = (one and one.option) or (d.name.removesuffix(f"_{unit}") if unit else d.name).replace("_", "-")
    if d.type is bool and d.default:
        both = argparse.BooleanOptionalAction
        command.add_argument(f"--{name}", dest=d.name, action=both, default=True, help=help_of(d))
        return
    if d.type is bool:
        command.add_argument(f"--{name}", dest=d.name, action="store_true", help=sentence(d.text))
        return
    more: dict[str, Any] = {"metavar": metavar, "help": help_of(d)}
    if one is not None:
        many = "+" if one.many is True else one.many or ("?" if one.alone else None)
        more = {"metavar": one.metavar, "nargs": many, "const": one.alone or None, "required": one.required}
        more["help"] = sentence(d.text) if one.required or one.repeated else help_of(d)
        more |= {"action": "append"} if one.repeated else {}
    default = d.default if d.default != "" else None
    more = {key: value for key, value in more.items() if value is not None}
    command.add_argument(
        f"--{name}", dest=d.name, type=d.type, choices=d.choices or None, default=default, **more
    )


def sentence(text: str, end: str = ".") -> str:
    """A setting's text as a sentence of help."""
    return f"{text[:1].upper()}{text[1:]}{end}"


def help_of(d: Description, default: str = "") -> str:
    """Help of a setting's option; default: in words, if different from the setting's own."""
    own = {True: "yes", False: "no"}.get(d.default, d.default) if d.type is bool else d.default
    text, _, empty = d.text.partition("; empty: ")
    shown = default or empty or f"{f'{own:g}' if d.type is float else own} {d.unit}".rstrip()
    return f"{sentence(text, '')} (default: {shown})."


def add_results(command: argparse.ArgumentParser) -> None:
    """--out and --json."""
    command.add_argument(
        "--out", required=True, metavar="DIR", help="Folder in which the results are written."
    )
    command.add_argument(
        "--json", action="store_true", help="Write one JSON message per line to standard output."
    )


def add_scheduler(command: argparse.ArgumentParser) -> None:
    """--scheduler, whose workers simulate in place of this machine's."""
    command.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a Dask scheduler whose workers do the simulations, such as tcp://host:8786.",
    )


def add_device(command: Group) -> None:
    """--device."""
    from ..fem.device import DEVICE

    add_setting(command, DEVICE, "cpu|cuda:0")


def require_out(options: argparse.Namespace) -> None:
    """Raise InputError if --out names no folder."""
    from ..errors import InputError

    if not options.out.strip():
        raise InputError(
            "no output folder was given", "--out", "give the folder in which to write the results"
        )
