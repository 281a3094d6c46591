"""Presets and node groups in the user's asset browser, node groups on curves, and the sample scene."""

from ..preview import nodes
from ..shared.blender_property import Choice
from ..shared.operators import FreeOperator, RootOperator, operator
from . import library
from . import sample as sample_scenes


@operator(FreeOperator, "Add to Asset Browser", undo=False)
def assets(operator):
    """Put presets, resins, printers and node groups into the asset browser: a library in your own folder"""
    folder = library.add()
    operator.report(
        {"INFO"}, f"Presets, resins, printers and node groups are in the library {library.NAME}: {folder}"
    )


@operator(FreeOperator, "Remove from Asset Browser", undo=False)
def assets_remove():
    """Remove this extension's assets from the asset browser; files that use them keep theirs"""
    library.remove()


def _skinned(context):
    obj = getattr(context, "object", None)
    return obj if obj is not None and obj.type in ("MESH", "CURVE", "CURVES") else None


class _OnCurve(RootOperator):
    find_root = staticmethod(_skinned)
    no_root, linked_too = "Select a curve or a mesh", True


@operator(
    _OnCurve,
    "Skin with Nodes",
    group=Choice(
        "Group",
        "Node group to add as a modifier",
        items=[(name, name, one.text) for name, one in nodes.GROUPS.items()],
    ),
)
def skin(root, group):
    """Give the active curve or mesh a node group: tubes, a waveguide with wells, balls"""
    nodes.skin(root, group)


@operator(
    FreeOperator,
    "Sample Scene",
    scene=Choice(
        "Scene",
        "What is added",
        items=[(name, name.capitalize(), text) for name, (text, _) in sample_scenes.SCENES.items()],
    ),
)
def sample(context, scene):
    """Add a sample scene: an overview, or the start of one task"""
    sample_scenes.build(context, scene)
