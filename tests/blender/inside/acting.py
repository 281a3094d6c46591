"""What a user does, in short."""

import bpy

from mu_addon.blender.unit import object as unit_object


def add(**settings):
    """Add a unit; returns its root object."""
    assert bpy.ops.mu.add(**settings) == {"FINISHED"}
    return unit_object.active_root(bpy.context)


def refused(operator, **settings):
    """What an operator says as it refuses."""
    try:
        operator(**settings)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("it was not refused")


def operators():
    """Every operator of the extension."""
    return [cls for cls in bpy.types.Operator.__subclasses__() if cls.__name__.startswith("MU_OT_")]
