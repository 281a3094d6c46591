"""Options of inputs that are no plain values, and the objects that are made of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from .options import help_of

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..run.context import RunContext
    from ..simulate_and_place.named_effects import NamedEffects


@cache
def _presets(kind: str = "") -> str:
    """Names of the shipped units, or of presets of another kind, in words."""
    from ..design.assets import asset_names

    *first, last = asset_names("presets", kind)
    return f"{', '.join(first)} or {last}" if first else last


def _add_named(command: Any, name: str, required: bool, presets: str) -> None:
    """--preset or a file of parameters."""
    which = command.add_mutually_exclusive_group(required=required)
    which.add_argument("--preset", metavar="NAME", help=f"{name.capitalize()} preset: {presets}.")
    which.add_argument(f"--{name}", metavar="FILE", help=f"{name.capitalize()} parameters, a TOML file.")


def _add_model(command: Any) -> None:
    applied = "Extended model, the model.toml of `diagnose`: its identified effects are applied to the unit."
    command.add_argument("--model", metavar="FILE", help=applied)


def _takes_model(one: Any) -> bool:
    return bool(one.modelled and one.needed and not one.default)


def _add_unit(command: Any, one: Any) -> None:
    _add_named(command, "unit", one.needed and not one.default, _presets())
    if _takes_model(one):
        _add_model(command)


def _unit(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    if _takes_model(one):
        return modelled(options, context, whole=False)[0]
    from ..design.parameters import load_preset

    if options.preset is None and options.unit is None:
        return load_preset(one.default) if one.default else None
    return _unit_of(options)


def _gripper(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from ..design.gripper import load_gripper, read_gripper

    return load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)


def _plan(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from ..studies.parameter_study.plan import read_plan

    return read_plan(Path(options.file)).continued(Path(options.out) / "sweep.toml", options.add)


def _add_effects(command: Any, one: Any) -> None:
    from ..simulate_and_place.settings import ORIENTATION

    _add_model(command)
    command.add_argument(
        "--orientation", type=float, default=ORIENTATION.default, metavar="DEG", help=help_of(ORIENTATION)
    )


def _effects(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    # The model changes the unit's parameters, too.
    values["unit"], effects = modelled(options, context)
    return effects


def _add_obstacles(command: Any, one: Any) -> None:
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


def _obstacles(options: argparse.Namespace, context: RunContext, one: Any, values: dict[str, Any]) -> Any:
    from ..studies.unit_inputs import obstacles_for

    return obstacles_for(values["unit"], options.obstacles, values["body"]) if options.obstacles else ()


def _ask(options: argparse.Namespace, context: RunContext, one: Any, values: Any) -> Any:
    from .asking import asker

    return asker(options)


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


def _unit_of(options: argparse.Namespace) -> Unit:
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
    from ..simulate_and_place.named_effects import NamedEffects

    unit, turn = _unit_of(options), options.orientation if whole else 0.0
    effects = NamedEffects(orientation_deg=turn, where="--orientation")
    if options.model is not None:
        from ..simulate_and_place.extended_unit import read_extended

        found = read_extended(unit, options.model)
        found = found if whole else found.of_parameters()
        if found.doubt:
            remedy = "make the measurement that the diagnosis proposes before you trust this simulation"
            context.progress.warning(f"the model's {found.doubt}", str(options.model), remedy)
        for words in found.left_out:
            context.progress.warning(f"not applied here: {words}", str(options.model))
        model = {"applied": found.applied, "left_out": found.left_out, "doubt": found.doubt}
        context.summary["model"] = model
        unit, effects = found.unit, attrs.evolve(found.effects, orientation_deg=turn)
    if turn and not effects.has_gravity:
        context.progress.warning(
            "gravity is not part of this model, so the orientation has no effect", "--orientation"
        )
    return unit, effects


OBJECTS: dict[str, tuple[Callable[..., None], Callable[..., Any]]] = {
    "unit": (_add_unit, _unit),
    "gripper": (lambda command, one: _add_named(command, "gripper", True, _presets("gripper")), _gripper),
    "effects": (_add_effects, _effects),
    "obstacles": (_add_obstacles, _obstacles),
    "plan": (lambda command, one: command.add_argument("file", metavar="FILE", help=one.text), _plan),
    "ask": (lambda command, one: None, _ask),
}
"""By kind of an input that is no plain value: its options are added, its value made of them."""
