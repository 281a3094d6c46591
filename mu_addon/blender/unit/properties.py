"""Parameters of the core as Blender properties: one group for each section, from its descriptions.

A parameter added to the core appears here, with its bounds, meaning and source, without a line of code.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import textwrap

import attrs
import bpy
import numpy as np
from bpy.props import CollectionProperty, PointerProperty, StringProperty

from ...design.parameters import SECTIONS, Unit
from ...design.quantity import describe
from ...errors import InputError
from ...fem.device import DEVICE
from ...graph.definition import FILE
from ...meshing.settings import REFINE, SELF_CONTACT
from ...simulate_and_place.settings import ALL_PATHS, ORIENTATION, PATHS, PROTOCOL, SELF_FRICTION
from ..shared.blender_property import (
    Choice,
    Flag,
    Integer,
    Text,
    blender_property,
    exact,
    path_property,
)
from ..shared.registration import property_of
from ..shared.updates import Signal
from .fields import generated_group, set_sections, tied

PARAMETERS_CHANGED, VIEW_CHANGED = Signal(), Signal()
"""Sent with the root whose parameters changed, and with the root whose displayed parts changed."""


def _changed(group, context):
    PARAMETERS_CHANGED.send(group.id_data)


def _candidates_changed(unit, context):
    if unit.candidates and unit.show == "result":
        # They lie on the unit at rest: beside a bent one they would lie beside its lattice.
        unit.show = "preview"
    PARAMETERS_CHANGED.send(unit.id_data)


GROUPS = {section.section: generated_group(section, _changed) for section in SECTIONS}
_HEAD = {d.name: d for d in describe(Unit)}


class MU_PG_study(bpy.types.PropertyGroup):
    """Settings of the next simulation."""

    command: Choice(
        "Job",
        "What is simulated",
        items=[
            ("place", "Place the Sensor", "Motion of the unit and the ranking of all sensor paths"),
            ("simulate", "Motion Only", "Motion of the unit without a sensor"),
        ],
        default="place",
    )
    paths: blender_property(
        PATHS,
        items=[
            ("windows", "Along the Anchors", "Paths through neighbouring anchors, alpha1 and on"),
            (
                "graph",
                "Whole Lattice",
                "Also the path along any struts that disturbs the motion least: takes minutes to hours more",
            ),
        ],
    )
    all_paths: blender_property(ALL_PATHS, name="All Paths in Full")
    # The shipped default takes place an hour; at this one it takes a quarter of an hour.
    refine: blender_property(REFINE._replace(default=0.5), name="Refinement", precision=2, step=5)
    self_contact: blender_property(SELF_CONTACT, name="Self-Contact")
    self_friction: blender_property(SELF_FRICTION, name="Friction", soft_max=1.0, step=5, precision=2)
    device: blender_property(
        DEVICE,
        items=[
            ("cpu", "CPU", "The processor, by factorisation"),
            ("cuda:0", "CUDA", "The first CUDA device, by conjugate gradients"),
        ],
    )
    protocol: blender_property(PROTOCOL, path=FILE)
    orientation_deg: blender_property(ORIENTATION, name="Gravity (deg)", precision=1, step=100)
    # model.toml of the effects that a diagnosis named beside the unit's parameters, see `effects`.
    effects: StringProperty(options={"HIDDEN"})
    # The run whose results were shown last, and the design at which it was chosen, see `study_folder`.
    run: StringProperty(options={"HIDDEN"})
    run_design: StringProperty(options={"HIDDEN"})
    # The run that the shown one is compared with.
    against: StringProperty(options={"HIDDEN"})
    folder: path_property(
        "Study Folder",
        "Folder of this unit's runs. Empty: beside the .blend file, or the user's folder",
        folder=True,
    )


def _view_changed(group, context):
    VIEW_CHANGED.send(group.id_data)


class MU_PG_step(bpy.types.PropertyGroup):
    """One step of the design in a unit's stack; its name is the core's."""

    muted: Flag("Mute", "Leave this step out: its input is passed on unchanged", update=_changed)
    shown: Flag("Show", "Show this step's result in the preview", update=_changed)


def title_property(noun: str):
    """Name of a unit or gripper object, as the core accepts it: one line, 80 characters."""

    def read(group) -> str:
        name = "".join(c if c.isprintable() else " " for c in group.id_data.name)
        return name.strip()[:80] or noun

    def write(group, value: str) -> None:
        group.id_data.name = value

    text = f"Name of the {noun}, which is that of its object"
    return Text("Name", text, get=read, set=write)


@property_of(bpy.types.Object, "mu_unit")
class MU_PG_unit(bpy.types.PropertyGroup):
    """One Monolithic Unit, kept on its root object."""

    __annotations__ = {
        "uuid": StringProperty(options={"HIDDEN"}),
        "title": title_property("unit"),
        "scale": blender_property(_HEAD["scale"], _changed),
        **{
            name: PointerProperty(type=group, description=textwrap.shorten(group.__doc__ or name, 200))
            for name, group in GROUPS.items()
        },
        "study": PointerProperty(type=MU_PG_study, description="Stages of the next simulation"),
        "stack": CollectionProperty(type=MU_PG_step, description="Steps of the design, in their order"),
        "step": Integer("Step", "The step whose parameters are shown"),
        # Name and values of the resin that was chosen, see `resins`.
        "resin": StringProperty(options={"HIDDEN"}),
        "path": Text("Sensor Path", "Window of anchors that the waveguide follows", update=_changed),
        "cut": Flag(
            "Cut Open", "Show the unit cut in its bending plane, to see chambers and wall", update=_changed
        ),
        "candidates": Flag(
            "Show Candidates",
            "Draw every candidate path beside the unit at rest, at its true height, to compare "
            "them and choose one by a click. Result hides them, because the unit is bent there",
            update=_candidates_changed,
        ),
        "show": Choice(
            "Show",
            "The unit as it is being designed, as it will be printed, or as it moves",
            items=[
                ("preview", "Preview", "Skeleton of the design, follows every slider"),
                ("solid", "Solid", "The printable solid that was built last"),
                ("result", "Result", "The motion of the shown run, coloured, in the unit's own place"),
            ],
            default="preview",
            update=_view_changed,
        ),
        # Meshes that the object shows, one or the other, and the user's envelope.
        **{
            name: PointerProperty(type=bpy.types.Mesh, options={"HIDDEN"})
            for name in ("preview", "solid", "envelope")
        },
        # Inputs of the last preview, and why it could not follow the parameters.
        "built": StringProperty(options={"HIDDEN"}),
        "trouble": StringProperty(options={"HIDDEN"}),
    }


CLASSES = (*GROUPS.values(),)


def section_of(props, section: str) -> dict:
    """Values of one section of a unit's properties, as the core's parameters."""
    group = getattr(props, section)
    (core,) = (s for s in SECTIONS if s.section == section)
    found = [(d, getattr(group, d.name)) for d in describe(core)]
    values = {d.name: exact(value) if d.type is float else value for d, value in found}
    if section == "chambers":
        bladder = tied({"cell_mm": values["cell_mm"]})["bladder_diameter_mm"]
        # One value in two properties: single precision may round them apart.
        if np.isclose(values["bladder_diameter_mm"], bladder, rtol=1e-6):
            values["bladder_diameter_mm"] = bladder
    return values


def to_unit(props) -> Unit:
    """The core's unit from Blender's properties; raises InputError where a rule is broken."""
    sections = {s.section: s(**section_of(props, s.section)) for s in SECTIONS}
    return Unit(name=props.title, scale=exact(props.scale), **sections)


def shape_hash(unit: Unit) -> str:
    """Hash of a unit without its name, so that a new name makes no result stale."""
    return attrs.evolve(unit, name="unit").hash()


def shape_now(props) -> str:
    """That hash of a unit's present properties, "" where a rule is broken."""
    try:
        return shape_hash(to_unit(props))
    except InputError:
        return ""


def from_unit(props, unit: Unit) -> None:
    """Set Blender's properties to a unit; each still calls its update, see `updates.paused`."""
    props.title, props.scale = unit.name, unit.scale
    set_sections(props, SECTIONS, unit)
