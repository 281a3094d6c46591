"""The designer's seat in Blender; the only package that imports bpy, and no module of the core imports it."""

from __future__ import annotations

_registered = False


def register() -> None:
    """Add classes, menus and handlers to Blender; where that fails, nothing is left behind."""
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
    """Take everything out of Blender again and end the simulations that this session started."""
    global _registered
    if _registered:
        _remove(_modules())
    _registered = False


def _modules():
    """Modules with something to register, in the order they need each other."""
    from . import (
        bench,
        evidence,
        evidence_panel,
        gripper_panel,
        gripper_properties,
        legend,
        legend_object,
        live,
        menus,
        motion_parts,
        motion_properties,
        obstacle_panel,
        obstacles,
        operators,
        panels,
        print_panel,
        printing,
        properties,
        results_panel,
        sensor,
        sensor_panel,
        sensor_plot,
        simulation,
        stack_panel,
        thumbnails,
        track_panel,
        twin,
    )

    return [
        properties,
        motion_properties,
        obstacles,
        gripper_properties,
        evidence,
        bench,
        printing,
        live,
        motion_parts,
        legend_object,
        simulation,
        twin,
        sensor,
        thumbnails,
        operators,
        panels,
        obstacle_panel,
        print_panel,
        stack_panel,
        results_panel,
        evidence_panel,
        sensor_panel,
        gripper_panel,
        track_panel,
        legend,
        sensor_plot,
        menus,
    ]


def _remove(modules):
    for module in reversed(modules):
        module.unregister()
