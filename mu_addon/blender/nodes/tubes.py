"""Tubes along edges, their radius from an attribute: struts, candidate paths, and any edges of a user's."""

from __future__ import annotations

from ..compat import link_radius
from .wiring import Wiring

NAME = "MU Tubes"
VERSION = 1
TEXT = "Tubes along the edges of a mesh; the point attribute `radius` gives their radius"


def build(tree) -> None:
    """Edges to curves, a circle swept along them, scaled by `radius` or, where there is none, by Radius."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Sides", "Int", 8, 3, 64, "Flat pieces around a tube")
    w.socket("Radius", "Float", 1.0, 0.0, 1000.0, "Radius where the geometry has no attribute `radius`")
    w.socket("Material", "Material")
    radius = w.node("GeometryNodeInputNamedAttribute", {"data_type": "FLOAT"}, Name="radius")
    chosen = w.node(
        "GeometryNodeSwitch",
        {"input_type": "FLOAT"},
        Switch=radius.outputs["Exists"],
        False_=w.given("Radius"),
        True_=radius.outputs["Attribute"],
    ).outputs[0]
    curve = w.node("GeometryNodeMeshToCurve", Mesh=w.given("Geometry"))
    circle = w.node("GeometryNodeCurvePrimitiveCircle", Resolution=w.given("Sides"), Radius=1.0)
    sweep = w.node("GeometryNodeCurveToMesh", Profile_Curve=circle.outputs["Curve"], Fill_Caps=True)
    link_radius(tree, sweep, curve.outputs["Curve"], chosen)
    smooth = w.smooth(sweep.outputs["Mesh"])
    painted = w.node("GeometryNodeSetMaterial", Geometry=smooth, Material=w.given("Material"))
    w.output(painted.outputs["Geometry"])
