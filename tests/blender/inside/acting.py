"""What a user does, in short."""

import bpy
import numpy as np

from mu_addon.blender.results import runs
from mu_addon.blender.unit import object as unit_object
from mu_addon.blender.unit.drawing import PARTS


def add(**settings):
    """Add a unit, to a scene in millimetres unless said otherwise; returns its object."""
    assert bpy.ops.mu.add(**{"millimetres": True, **settings}) == {"FINISHED"}
    return unit_object.active_root(bpy.context)


def with_runs(home):
    """A unit that shows the runs in a folder."""
    root = add(preset="mu-0.75x")
    root.mu_unit.study.folder = str(home)
    unit_object.rebuild(root)
    runs.refresh()
    return root


def attribute(root, name):
    """Values of a point attribute of a unit's preview."""
    mesh = root.mu_unit.preview
    return np.array([item.value for item in mesh.attributes[name].data])


def points_of(root, part):
    """Points (n, 3) in mm of a part of a unit's preview, none where it is not drawn."""
    mesh = root.mu_unit.preview
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", found)
    return found.reshape(-1, 3).astype(float)[attribute(root, "mu_part") == PARTS.index(part)]


def shown_parts(root):
    """Names of the parts that a unit's preview is made of."""
    return {PARTS[number] for number in set(attribute(root, "mu_part"))}


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
