"""Presets and their operators: shipped units, and the user's own as TOML files in the user's folder."""

import re
from pathlib import Path

import attrs

from ...design.parameters import Unit, load_preset, preset_names, read_unit, write_unit
from ...errors import InputError, OutputError
from ..shared.blender_property import Text
from ..shared.compat import user_folder
from ..shared.operators import FreeOperator, operator
from . import object as unit_object
from .base_classes import UnitOperator
from .properties import to_unit

USER = "user:"


def names() -> list[str]:
    """Built-in names, then the user's own with the prefix `user:`."""
    return [*preset_names(), *(USER + path.stem for path in sorted(_folder().glob("*.toml")))]


def load(name: str) -> Unit:
    """The unit of that preset; raises InputError."""
    return read_unit(_file(name)) if name.startswith(USER) else load_preset(name)


def save(unit: Unit, title: str) -> str:
    """Save a unit as the user's preset and return its name; raises InputError and OutputError."""
    title = title.strip()
    if not re.fullmatch(r"[\w][\w .+-]{0,59}", title):
        raise InputError(
            f"{title!r} cannot be the name of a preset",
            "preset",
            "use 1 to 60 letters, digits, spaces and . + - _, a letter or digit first",
        )
    write_unit(unit, _file(USER + title))
    return USER + title


def remove(name: str) -> None:
    """Delete a user's preset; raises InputError for one shipped with the extension."""
    if not name.startswith(USER):
        raise InputError(f"{name} comes with the extension", "preset", "only your own presets can be removed")
    try:
        _file(name).unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(f"cannot remove the preset: {error.strerror}", str(_file(name)), "") from error


def _file(name: str) -> Path:
    return _folder() / f"{name.removeprefix(USER)}.toml"


def _folder() -> Path:
    return user_folder("presets")


@operator(UnitOperator, "Load Preset", name=Text("Preset", "Name of a preset; your own begin with `user:`"))
def preset_load(root, name):
    """Set every parameter of the unit to those of a preset"""
    core = load(name)
    # Without the number of a duplicate name.
    if re.sub(r"\.\d{3,}$", "", root.name) not in {known.removeprefix(USER) for known in names()}:
        core = attrs.evolve(core, name=root.mu_unit.title)  # the user's own name stays
    unit_object.take(root, core)


def _ask_name(operator, context, event):
    operator.name = unit_object.active_root(context).mu_unit.title
    return context.window_manager.invoke_props_dialog(operator)


@operator(
    UnitOperator,
    "Save Preset",
    undo=False,
    invoke=_ask_name,
    name=Text("Name", "Name of your preset", default="my unit"),
)
def preset_save(operator, root, name):
    """Save the unit's parameters as your own preset, a TOML file that headless/run.py also reads"""
    kept = save(to_unit(root.mu_unit), name)
    operator.report({"INFO"}, f"Preset {kept.removeprefix(USER)} saved")


@operator(
    FreeOperator,
    "Remove Preset",
    undo=False,
    invoke=lambda operator, context, event: context.window_manager.invoke_confirm(operator, event),
    name=Text("Preset", "Name of your preset"),
)
def preset_remove(name):
    """Remove a preset of your own"""
    remove(name)
