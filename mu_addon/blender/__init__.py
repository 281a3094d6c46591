"""The Blender extension; the only package that imports bpy, and no module of the core imports it."""

from __future__ import annotations

from importlib import import_module

_MODULES = (
    # Read by others: properties, state, handlers.
    "unit.properties",
    "results.properties",
    "obstacles.state",
    "optimize.properties",
    "gripper.properties",
    "evidence.state",
    "track.properties",
    "printing.properties",
    "unit.preview_update",
    "path.candidates",
    "results.motion",
    "results.runs",
    "scene.unsaved",
    "results.legend_object",
    "jobs.preferences",
    "jobs.start_child",
    "jobs.prepared",
    "live_bending.properties",
    "live_bending.state",
    "sensor.twin",
    "sensor.state",
    "sensor.properties",
    "node_tree.sockets",
    "node_tree.classes",
    "node_tree.state",
    "gripper.object",
    "gripper.timeline",
    "scene.gestures",
    "shared.file_cache",
    # Operators.
    "unit.operators",
    "unit.presets",
    "unit.resins",
    "path.picking",
    "simulate.operators",
    "optimize.operators",
    "results.operators",
    "results.run_operators",
    "results.field_operators",
    "printing.solid_operators",
    "printing.operators",
    "steps.operators",
    "body.operators",
    "grading.operators",
    "obstacles.operators",
    "gripper.operators",
    "assets.operators",
    "assets.dropped",
    "evidence.operators",
    "import_data.importing",
    "track.operators",
    "sensor.operators",
    "node_tree.groups",
    "node_tree.operators",
    "scene.dropping",
    "scene.handles",
    "simulate.timings",
    # Drawing; panels appear in the sidebar in this order, that of the work.
    "sidebar.unit_panel",
    "steps.panel",
    "path.panel",
    "simulate.panel",
    "obstacles.panel",
    "results.panel",
    "results.run_panel",
    "optimize.panel",
    "evidence.panel",
    "printing.panel",
    "sensor.panel",
    "gripper.panel",
    "track.panel",
    "node_tree.panel",
    "live_bending.words",
    "results.legend",
    "results.probe",
    "path.legend",
    "path.hover",
    "sensor.plot",
    "jobs.header",
    "sidebar.menus",
)
"""Modules with something to register, in order of dependence."""

_registered = False


def register() -> None:
    """Register classes, menus and handlers with Blender; on failure nothing is left behind."""
    global _registered
    if _registered:
        return
    done = []
    try:
        for module in _modules():
            done.append(module)
            module.register()
    except Exception:
        _remove(done)
        raise
    _registered = True


def unregister() -> None:
    """Unregister everything, and end the jobs that need Blender."""
    global _registered
    if _registered:
        _remove(_modules())
    _registered = False


def _modules():
    return [import_module(f".{name}", __name__) for name in _MODULES]


def _remove(modules):
    for module in reversed(modules):
        module.unregister()
