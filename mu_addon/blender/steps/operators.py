"""The core's steps as operators, made from its list, each with its parameters in the redo panel."""

import attrs
import bpy

from ...design.parameters import SECTIONS
from ...design.quantity import describe
from ...design.repairs import tied
from ...design.steps import STEPS, Step, downstream
from ...errors import InputError
from ..shared import updates
from ..shared.blender_property import Choice, Flag, Text, blender_property, exact, millimetres, step_of
from ..shared.operators import operator
from ..shared.wording import label, sentence, tooltip
from ..unit import object as unit_object
from ..unit import stack
from ..unit.base_classes import UnitOperator
from ..unit.fields import TRUE, description, true_scale
from ..unit.properties import from_unit, to_unit

_OF_THEIR_OWN = ("path", "solid")
"""Steps with separate operators."""


def _annotations(step: Step) -> dict:
    """Properties of a step's operator: its parameters, and True if it is muted."""
    found = {}
    for section in SECTIONS:
        for d in describe(section):
            if f"{section.section}.{d.name}" not in step.own:
                continue
            found[d.name] = blender_property(d, options={"SKIP_SAVE"})
            if d.unit == "mm":
                # Scripts set it in mm at scale 1; the redo panel shows the true length.
                shared = {"name": label(d), "description": tooltip(d), "options": {"SKIP_SAVE"}}
                found[d.name + TRUE] = millimetres(step_of(d.high), **shared)
    if step.muting:
        found["muted"] = Flag("Mute", f"Leave this step out: {step.muting}", options={"SKIP_SAVE"})
    return found


class _OfStep(UnitOperator):
    """Sets the given parameters of a step, and runs the step again."""

    step: Step

    def invoke(self, context, event):
        props = unit_object.active_root(context).mu_unit
        self._take(props)
        if self.step.muting:
            self.muted = props.stack[self.step.name].muted
        return self.execute(context)

    def act(self, context, root):
        props = root.mu_unit
        unit = to_unit(props)
        given: dict[str, dict] = {}
        for section, name in stack.own_parameters(self.step):
            true = hasattr(self, name + TRUE) and self.properties.is_property_set(name + TRUE)
            if true or self.properties.is_property_set(name):
                value = getattr(self, name)
                if true:
                    # Values dragged past a bound are clamped.
                    d = description(section, name)
                    value = getattr(self, name + TRUE) / true_scale(props, d)
                    value = min(max(value, d.low), d.high)
                value = exact(value) if isinstance(value, float) else value
                if value != getattr(getattr(unit, section), name):
                    given.setdefault(section, {})[name] = value
        changed = {s: attrs.evolve(getattr(unit, s), **tied(values)) for s, values in given.items()}
        unit = attrs.evolve(unit, **changed)
        before = stack.STACK.counts.copy()
        with updates.paused():
            stack.fill(props)
            from_unit(props, unit)
            if self.step.muting and self.properties.is_property_set("muted"):
                props.stack[self.step.name].muted = self.muted
            props.step = list(STEPS).index(self.step.name)
        stack.STACK.again(self.step.name, stack.given(root, unit))
        if not unit_object.rebuild(root):
            raise InputError(props.trouble)
        self._take(props)
        made = [name for name in STEPS if stack.STACK.counts[name] > before[name]]
        self.report({"INFO"}, f"Updated: {', '.join(made)}; all other steps unchanged")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        for _, name in stack.own_parameters(self.step):
            layout.prop(self, name + TRUE if hasattr(self, name + TRUE) else name)
        if self.step.muting:
            layout.prop(self, "muted")

    def _take(self, props) -> None:
        """Take the unit's values, for the redo panel."""
        for section, name in stack.own_parameters(self.step):
            value = getattr(getattr(props, section), name)
            setattr(self, name, value)
            if hasattr(self, name + TRUE):
                scale = true_scale(props, description(section, name))
                setattr(self, name + TRUE, exact(value) * scale)


def _generated(step: Step) -> type:
    text = sentence(step.text)
    after = downstream(step.name)
    if after:
        text += f". Made from it: {', '.join(after)}"
    members = {
        "__doc__": text,
        "__annotations__": _annotations(step),
        "bl_idname": f"mu.{step.name}",
        "bl_label": step.name.capitalize(),
        "step": step,
    }
    return type(f"MU_OT_{step.name}", (_OfStep, bpy.types.Operator), members)


@operator(
    UnitOperator,
    "Mute Step",
    step=Choice(
        "Step",
        "Step of the design",
        items=[(step.name, step.name.capitalize(), step.muting) for step in STEPS.values() if step.muting],
    ),
    muted=Flag("Mute", "Leave the step out", default=True),
)
def mute(root, step, muted):
    """Mute or unmute a step of the design"""
    with updates.paused():
        stack.fill(root.mu_unit)
        root.mu_unit.stack[step].muted = muted
    unit_object.rebuild(root)


@operator(
    UnitOperator, "Run Step Again", step=Text("Step", "Name of a step of the design", default="profile")
)
def again(root, step):
    """Run one step again, and of the later steps those whose input changes"""
    stack.STACK.again(step, stack.given(root, to_unit(root.mu_unit)))
    unit_object.rebuild(root)


CLASSES = (*(_generated(step) for step in STEPS.values() if step.name not in _OF_THEIR_OWN),)
