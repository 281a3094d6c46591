"""A ball at every point, its radius from an attribute: anchors, junctions."""

from __future__ import annotations

from .wiring import Wiring

NAME = "MU Balls"
VERSION = 1
TEXT = "A ball at every point; the point attribute `radius` gives its radius"


def build(tree) -> None:
    """Spheres of radius 1 on points, scaled by `radius`; they take the object's first material."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Detail", "Int", 3, 1, 6, "Subdivisions of a ball")
    w.socket("Material", "Material")
    radius = w.node("GeometryNodeInputNamedAttribute", {"data_type": "FLOAT"}, Name="radius")
    ball = w.node("GeometryNodeMeshIcoSphere", Radius=1.0, Subdivisions=w.given("Detail"))
    placed = w.node(
        "GeometryNodeInstanceOnPoints",
        Points=w.given("Geometry"),
        Instance=ball.outputs["Mesh"],
        Scale=radius.outputs["Attribute"],
    )
    real = w.node("GeometryNodeRealizeInstances", Geometry=placed.outputs["Instances"])
    smooth = w.smooth(real.outputs["Geometry"])
    painted = w.node("GeometryNodeSetMaterial", Geometry=smooth, Material=w.given("Material"))
    w.output(painted.outputs["Geometry"])
