"""Colours of the parts, as materials that the user may change: made once and then left alone."""

from __future__ import annotations

import bpy

COLOURS = {
    "MU Membrane": (0.16, 0.42, 0.55, 1.0),
    "MU Section": (0.80, 0.30, 0.22, 1.0),
    "MU Lattice": (0.72, 0.74, 0.76, 1.0),
    "MU Anchors": (0.05, 0.06, 0.08, 1.0),
    "MU Waveguide": (1.0, 0.42, 0.02, 1.0),
    "MU Wells": (0.30, 0.10, 0.0, 1.0),
    "MU Candidate": (0.62, 0.68, 0.78, 1.0),
    "MU Flaws": (1.0, 0.05, 0.05, 1.0),
    # Orange is the waveguide's.
    "MU Doubt": (0.72, 0.20, 0.80, 1.0),
    "MU Solid": (0.62, 0.66, 0.70, 1.0),
    "MU Measured": (1.0, 0.42, 0.05, 1.0),
    "MU Model": (0.12, 0.45, 1.0, 1.0),
    "MU Extended Model": (0.05, 0.75, 0.35, 1.0),
    "MU Dial": (0.75, 0.75, 0.75, 1.0),
    "MU Legend Text": (0.80, 0.80, 0.80, 1.0),
    "MU Layer": (1.0, 0.72, 0.10, 1.0),
    "MU Enclosed": (0.10, 0.45, 0.85, 1.0),
    "MU Plate": (0.50, 0.53, 0.56, 1.0),
    "MU Obstacle": (0.42, 0.36, 0.30, 1.0),
    "MU Twin": (0.05, 0.55, 0.28, 1.0),
    "MU Twin Waiting": (0.45, 0.45, 0.45, 1.0),
    "MU Before": (0.30, 0.31, 0.33, 1.0),
    "MU Out of Range": (0.85, 0.03, 0.03, 1.0),
}


def material(name: str):
    """The material of that name, created with its colour if the file has none."""
    found = bpy.data.materials.get(name)
    if found is None:
        found = coloured(name, COLOURS[name])
        found.roughness = 0.5
    return found


def coloured(name: str, colour):
    """The material of that name, created if the file has none, in a colour (4,), linear."""
    found = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    found.diffuse_color = colour
    surface = found.node_tree.nodes.get("Principled BSDF") if found.node_tree else None
    if surface is not None:
        surface.inputs["Base Color"].default_value = colour
    return found


def unlit(name: str):
    """The material of that name with emission, so that light does not change its colour."""
    return bpy.data.materials.get(name) or shining(material(name))


def shining(found):
    """Make a material's surface a plain emission of its colour."""
    if found.node_tree is None:  # before 5.0
        found.use_nodes = True
    nodes = found.node_tree.nodes
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = found.diffuse_color
    found.node_tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return found


def wear(mesh, material) -> None:
    """Give a mesh a material in its first slot."""
    slots = mesh.materials
    if not slots:
        slots.append(material)
    elif slots[0] != material:
        slots[0] = material


def assign(mesh, *names: str) -> None:
    """Give a mesh these materials in its slots, in order, if it has none yet."""
    if not mesh.materials:
        for name in names:
            mesh.materials.append(material(name))
