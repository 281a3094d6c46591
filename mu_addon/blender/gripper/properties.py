"""A gripper's parameters on its root object: generated from the core's, and the settings of its grasp."""

from functools import lru_cache

import bpy
from bpy.props import PointerProperty, StringProperty

from ...design import parameters
from ...design.gripper import SECTIONS, Gripper
from ...design.quantity import describe
from ...design.settings import FRICTION
from ...grasp.settings import DENSITY, SIDE
from ...meshing.settings import SELF_CONTACT
from ..shared import displays
from ..shared.blender_property import (
    Choice,
    Flag,
    blender_property,
    exact,
    millimetres,
    path_property,
)
from ..shared.registration import property_of
from ..shared.updates import Signal
from ..unit.fields import generated_group, path_menu, set_sections
from ..unit.properties import title_property

PARAMETERS_CHANGED = Signal()
"""Sent with the root of the gripper whose parameters changed."""


def _changed(group, context):
    PARAMETERS_CHANGED.send(group.id_data)


GROUPS = {s.section: generated_group(s, _changed, "MU_PG_gripper_") for s in SECTIONS}


@lru_cache(maxsize=32)
def _chambers(finger: str) -> int:
    return parameters.from_toml(finger).chambers.count


def _cube_height(props):
    cube = displays.part(props.id_data, displays.GRIPPER, "cube")
    return 0.0 if cube is None else cube.location.z


def _put_cube(props, value):
    cube = displays.part(props.id_data, displays.GRIPPER, "cube")
    if cube is not None:
        cube.location.z = value


@property_of(bpy.types.Object, "mu_gripper")
class MU_PG_gripper(bpy.types.PropertyGroup):
    """One Monolithic Gripper, kept on its root object."""

    __annotations__ = {
        "uuid": StringProperty(options={"HIDDEN"}),
        # The unit of both fingers, as TOML: a gripper does not change when a preset does.
        "finger": StringProperty(options={"HIDDEN"}),
        "title": title_property("gripper"),
        "path": StringProperty(default="alpha4", update=_changed, options={"HIDDEN"}),
        "paths": path_menu(lambda props: _chambers(props.finger)),
        **{
            name: PointerProperty(type=group, description=group.__doc__ or name)
            for name, group in GROUPS.items()
        },
        "cut": Flag(
            "Cut Open",
            "Show the fingers cut in their bending plane, to see chambers and wall",
            update=_changed,
        ),
        "cube_mm": blender_property(SIDE, _changed, name="Cube"),
        "cube_height": millimetres(
            10,
            name="Cube Height",
            description="Height of the cube's centre above the plate",
            get=_cube_height,
            set=_put_cube,
            options={"SKIP_SAVE"},
        ),
        "density_g_per_ml": blender_property(DENSITY, name="Density (g/ml)", precision=2),
        "friction": blender_property(FRICTION, precision=2),
        "detail": Choice(
            "Job",
            "What is done",
            items=[
                ("quick", "Grasp, Quick Look", "A coarser mesh and longer steps"),
                ("full", "Grasp", "The grasp on the default mesh"),
                ("part", "Part to Print", "Only the printable part as STL and 3MF"),
            ],
        ),
        "self_contact": blender_property(SELF_CONTACT, name="Self-Contact"),
        "folder": path_property(
            "Grasp Folder",
            "Folder of the results. Empty: beside the .blend file, or the user's folder",
            folder=True,
        ),
        "trouble": StringProperty(options={"HIDDEN"}),
    }


CLASSES = (*GROUPS.values(),)


def to_gripper(props) -> Gripper:
    """The core's gripper from the properties; raises InputError where a rule is broken."""
    sections = {}
    for section in SECTIONS:
        group = getattr(props, section.section)
        sections[section.section] = section(
            **{d.name: exact(getattr(group, d.name)) for d in describe(section)}
        )
    unit = parameters.from_toml(props.finger)
    return Gripper(unit=unit, name=props.title, path=props.path, **sections)


def from_gripper(props, gripper: Gripper) -> None:
    """Set the properties to a gripper; each still calls its update, see `updates.paused`."""
    props.finger = parameters.to_toml(gripper.unit, comments=False)
    props.title, props.path = gripper.name, gripper.path
    set_sections(props, SECTIONS, gripper)
