"""Tubes along edges and curves, their radius from an attribute: struts, paths, users' curves."""

from __future__ import annotations

from ...shared.compat import link_radius
from .wiring import Wiring

NAME = "MU Tubes"
VERSION = 3
TEXT = "Tubes along curves and edges; the point attribute `radius`, or a curve's own, gives their radius"


def build(tree) -> None:
    """Edges as curves, and curves as they are: a circle swept along them, scaled by `radius` times Radius."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Sides", "Int", 8, 3, 64, "Flat pieces around a tube")
    w.socket("Radius", "Float", 1.0, 0.0, 1000.0, "Radius, or factor on the point attribute `radius`")
    w.socket("Material", "Material")
    curve = w.curves(w.given("Geometry"))
    radius = w.node("GeometryNodeInputNamedAttribute", {"data_type": "FLOAT"}, Name="radius")
    own = w.node(
        "GeometryNodeSwitch",
        {"input_type": "FLOAT"},
        Switch=radius.outputs["Exists"],
        False_=1.0,
        True_=radius.outputs["Attribute"],
    ).outputs[0]
    scaled = w.math("MULTIPLY", own, w.given("Radius"))
    circle = w.node("GeometryNodeCurvePrimitiveCircle", Resolution=w.given("Sides"), Radius=1.0)
    sweep = w.node("GeometryNodeCurveToMesh", Profile_Curve=circle.outputs["Curve"], Fill_Caps=True)
    link_radius(tree, sweep, curve, scaled)
    # Ends are flat, as a print's are: smooth ones look like dark holes. A tube's sides have four corners.
    corners = w.node("GeometryNodeInputMeshFaceNeighbors").outputs["Vertex Count"]
    sides = w.node("FunctionNodeCompare", {"data_type": "INT", "operation": "EQUAL"}, A=corners, B=4)
    smooth = w.smooth(sweep.outputs["Mesh"], sides.outputs["Result"])
    painted = w.node("GeometryNodeSetMaterial", Geometry=smooth, Material=w.given("Material"))
    w.output(painted.outputs["Geometry"])
