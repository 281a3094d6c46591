"""Options that several subcommands share, and the objects that they name."""

from __future__ import annotations

import argparse
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..design.quantity import Description
    from ..run.context import RunContext
    from ..run.study import Input
    from ..simulate_and_place.extended_unit import Extended
    from ..simulate_and_place.named_effects import NamedEffects

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


def add_report(command: argparse.ArgumentParser) -> None:
    """--no-report."""
    command.add_argument(
        "--no-report",
        dest="report",
        action="store_false",
        help="Compute the numbers only: no pictures, no report.html.",
    )


@cache
def presets(kind: str = "") -> str:
    """Names of the shipped units, or of presets of another kind, in words."""
    from ..design.assets import asset_names

    *first, last = asset_names("presets", kind)
    return f"{', '.join(first)} or {last}" if first else last


def add_unit(command: argparse.ArgumentParser, required: bool = True, results: bool = True) -> None:
    """--preset or --unit, and with `results` --out."""
    which = command.add_mutually_exclusive_group(required=required)
    which.add_argument("--preset", metavar="NAME", help=f"Unit preset: {presets()}.")
    which.add_argument("--unit", metavar="FILE", help="Unit parameters, a TOML file.")
    if results:
        add_results(command)


def add_scheduler(command: argparse.ArgumentParser) -> None:
    """--scheduler, whose workers simulate in place of this machine's."""
    command.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a Dask scheduler whose workers do the simulations, such as tcp://host:8786.",
    )


def add_model(command: Group) -> None:
    """--model, the result of a diagnosis."""
    applied = "Extended model, the model.toml of `diagnose`: its identified effects are applied to the unit."
    command.add_argument("--model", metavar="FILE", help=applied)


def add_orientation(command: Group) -> None:
    """--orientation, the direction of gravity."""
    from ..simulate_and_place.settings import ORIENTATION

    command.add_argument(
        "--orientation", type=float, default=ORIENTATION.default, metavar="DEG", help=help_of(ORIENTATION)
    )


def add_device(command: Group) -> None:
    """--device."""
    from ..fem.device import DEVICE

    add_setting(command, DEVICE, "cpu|cuda:0")


def add_obstacles(command: Group) -> None:
    """Rigid bodies that the unit may touch, each with its friction."""
    from ..design.settings import FRICTION

    command.add_argument(
        "--obstacle",
        action=_Obstacle,
        dest="obstacles",
        default=[],
        metavar="FILE",
        help="Closed surface of a rigid, fixed obstacle: STL, OBJ or PLY, in mm, in the unit's frame. "
        "Repeat the option for each obstacle.",
    )
    command.add_argument(
        "--friction",
        action=_Friction,
        type=float,
        metavar="MU",
        help=f"Friction coefficient of the preceding --obstacle (default: {FRICTION.default}, assumed).",
    )


class _Obstacle(argparse.Action):
    """Adds an obstacle's file, without its friction yet."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        namespace.obstacles = [*namespace.obstacles, (value, None)]


class _Friction(argparse.Action):
    """Sets the friction of the obstacle before it."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        if not namespace.obstacles or namespace.obstacles[-1][1] is not None:
            parser.error("write --friction after its --obstacle")
        *before, (path, _) = namespace.obstacles
        namespace.obstacles = [*before, (path, value)]


def require_out(options: argparse.Namespace) -> None:
    """Raise InputError if --out names no folder."""
    from ..errors import InputError

    if not options.out.strip():
        raise InputError(
            "no output folder was given", "--out", "give the folder in which to write the results"
        )


def unit_of(options: argparse.Namespace) -> Unit:
    """The unit that --preset or --unit names, with the wall of --resin; raises InputError."""
    from ..design.parameters import load_preset, read_unit

    unit = load_preset(options.preset) if options.preset is not None else read_unit(options.unit)
    resin = getattr(options, "wall_resin", None)
    if resin is None:
        return unit
    from ..materials.library import load_material, read_material

    return (read_material(resin) if resin.endswith(".toml") else load_material(resin)).in_unit(unit)


def modelled(
    options: argparse.Namespace, context: RunContext, whole: bool = True
) -> tuple[Unit, NamedEffects]:
    """The unit with the extended model of --model applied, and its effects beyond a unit's parameters.

    whole: False where no whole unit is simulated, and parameters alone are applied. Warns of effects that the
    simulation does not support.
    """
    import attrs

    from ..simulate_and_place.named_effects import NamedEffects

    unit, turn = unit_of(options), options.orientation if whole else 0.0
    effects = NamedEffects(orientation_deg=turn, where="--orientation")
    if options.model is not None:
        from ..simulate_and_place.extended_unit import read_extended

        found = read_extended(unit, options.model)
        found = _report_applied(found if whole else found.of_parameters(), options, context)
        unit, effects = found.unit, attrs.evolve(found.effects, orientation_deg=turn)
    if turn and not effects.has_gravity:
        context.progress.warning(
            "gravity is not part of this model, so the orientation has no effect", "--orientation"
        )
    return unit, effects


def _report_applied(found: Extended, options: argparse.Namespace, context: RunContext) -> Extended:
    if found.doubt:
        remedy = "make the measurement that the diagnosis proposes before you trust this simulation"
        context.progress.warning(f"the model's {found.doubt}", str(options.model), remedy)
    for words in found.left_out:
        context.progress.warning(f"not applied here: {words}", str(options.model))
    context.summary["model"] = {
        "applied": found.applied,
        "left_out": found.left_out,
        "doubt": found.doubt,
    }
    return found
