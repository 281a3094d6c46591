"""Add, rebuild and delete a unit; give the scene millimetres."""

import attrs
import bpy
from bpy.props import StringProperty

from ...design.parameters import Unit
from ...design.quantity import describe
from ...design.repairs import tied
from ...design.settings import PRESET
from ...errors import InputError
from ..shared import landing, scene_units, updates, viewports
from ..shared.blender_property import Choice, Flag, Number, Text, exact, listed
from ..shared.operators import FreeOperator, operator
from ..shared.wording import label, tooltip
from . import object as unit_object
from . import presets
from .base_classes import UnitOperator
from .broken import broken
from .fields import description, shown_value

_SCALE = next(d for d in describe(Unit) if d.name == "scale")


def _use_millimetres(context) -> None:
    """Give the scene millimetres; our objects, cursor and views keep their true sizes and positions."""
    before, units = scene_units.mm(context.scene), context.scene.unit_settings
    units.system, units.scale_length, units.length_unit = "METRIC", 0.001, "MILLIMETERS"
    factor = scene_units.mm(context.scene) / before
    if abs(factor - 1.0) < 1e-6:
        return
    context.scene.cursor.location *= factor
    viewports.scale(factor)
    # Here, so that one undo takes all of it back.
    scene_units.CHANGED.send(context.scene)


def _presets() -> list[tuple[str, str, str]]:
    return [
        (n, n.removeprefix(presets.USER), "Your own" if n.startswith(presets.USER) else "")
        for n in presets.names()
    ]


@operator(
    FreeOperator,
    "Monolithic Unit",
    preset=Choice("Preset", "Unit to begin with", items=listed(_presets), options={"SKIP_SAVE"}),
    scale=Number("Scale", tooltip(_SCALE), default=0.0, min=0.0, max=_SCALE.high, options={"SKIP_SAVE"}),
    millimetres=Flag(
        "Scene in Millimetres", "Also set the scene's unit of length, one Blender unit a millimetre"
    ),
    # The preset that the scale belongs to: another one chosen in the redo panel sets its own scale.
    scaled=StringProperty(options={"HIDDEN", "SKIP_SAVE"}),
    frame=Flag("Frame in View", "Bring the new unit into view", default=True),
)
def add(operator, context, millimetres, frame):
    """Add a Monolithic Unit: bladder actuator, lattice and sensor path in one body"""
    if not operator.properties.is_property_set("preset"):
        operator.preset = PRESET
    core = presets.load(operator.preset)
    if not operator.properties.is_property_set("scale") or operator.scaled not in ("", operator.preset):
        operator.scale = core.scale
    operator.scaled = operator.preset
    if exact(operator.scale) != core.scale:
        core = attrs.evolve(core, scale=max(exact(operator.scale), _SCALE.low))
    if millimetres:
        _use_millimetres(context)
    landing.land(context, unit_object.create(context, core))
    if frame:
        viewports.frame_selected(context)


@operator(UnitOperator, "Rebuild Unit")
def rebuild(root):
    """Build the unit's mesh again from its parameters, with everything that was edited or deleted by hand"""
    if root.mode == "EDIT":
        bpy.ops.object.mode_set(mode="OBJECT")
    if not unit_object.rebuild(root):
        raise InputError(root.mu_unit.trouble)


@operator(
    UnitOperator,
    "Use the Value That Fits",
    # The full rule, for which the head of the panel may have no room.
    tip=lambda context, given: given.why and f"{given.why}\n\nSet the nearest value that fits",
    section=Text("Section", "Section of the parameter: chambers, lattice ..."),
    name=Text("Parameter", "Name of the parameter"),
    why=StringProperty(options={"HIDDEN", "SKIP_SAVE"}),
)
def fit(root, section, name):
    """Set a parameter to the nearest value that keeps every design rule"""
    found, value = broken(root), None
    if found is not None:
        mending = {(r.section, r.name): r.value for r in found.repairs}
        value = mending.get((section, name), found.fits.get((section, name)))
    if value is None:
        what = f"{section}.{name} breaks no rule that another value would satisfy"
        raise InputError(what, "design", "change another field")
    setattr(getattr(root.mu_unit, section), name, value)
    # Another rule may still be broken, and has its own button.
    unit_object.rebuild(root)


def _what_fits(context, properties):
    """Parameters and their new values."""
    root = unit_object.active_root(context)
    found = None if root is None else broken(root)
    return "\n".join([str(fit_all.__doc__), *_repairs_in_words(root, found)]) if found else ""


@operator(UnitOperator, "Fix All", tip=_what_fits)
def fit_all(operator, root):
    """Set every parameter that breaks a rule to the nearest round value that keeps all of them"""
    found = broken(root)
    if found is None or not found.repairs:
        raise InputError("no rule is broken", "design", "there is nothing to do")
    changes = _repairs_in_words(root, found)
    with updates.paused():
        for repair in found.repairs:
            if repair.value is not None:
                group = getattr(root.mu_unit, repair.section)
                for name, value in tied({repair.name: repair.value}).items():
                    setattr(group, name, value)
    if not unit_object.rebuild(root):
        operator.report({"ERROR"}, root.mu_unit.trouble)
    else:
        operator.report({"INFO"}, f"Set {', '.join(changes)}")


def _repairs_in_words(root, found) -> list[str]:
    words = []
    for repair in found.repairs:
        if repair.value is not None:
            d = description(repair.section, repair.name)
            words.append(f"{label(d)} {shown_value(getattr(root.mu_unit, repair.section), d, repair.value)}")
    return words


@operator(UnitOperator, "Delete Unit")
def delete(root):
    """Delete the unit with all that shows its results; its study folder stays"""
    unit_object.delete(root)


@operator(FreeOperator, "Use Millimetres")
def millimetres(context):
    """Make one Blender unit a millimetre; units, grippers, obstacles and the view keep their true sizes"""
    _use_millimetres(context)


@operator(UnitOperator, "Select Unit", linked_too=True)
def select(context, root):
    """Select the unit itself, alone, if a display of it is the active object"""
    unit_object.make_active(context, root)
