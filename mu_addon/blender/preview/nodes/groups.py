"""Groups of Geometry Nodes for points and edges of any mesh: tubes, balls, labelled tubes, a colour field."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from ...shared.compat import link_radius
from .wiring import Wiring


class Group(NamedTuple):
    """A node group: its name and version, its description as an asset, its builder, groups that it uses.

    build: fills an empty tree; it is given the tree and the groups of `uses`. A higher version is rebuilt.
    """

    name: str
    version: int
    text: str
    build: Callable[..., None]
    uses: tuple[str, ...] = ()


def _tubes(tree) -> None:
    """Edges as curves, and curves as they are: a circle swept along them, scaled by `radius` times Radius."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Sides", "Int", 8, 3, 64, "Flat pieces around a tube")
    w.socket("Radius", "Float", 1.0, 0.0, 1000.0, "Radius, or factor on the point attribute `radius`")
    w.socket("Material", "Material")
    curve = w.curves(w.given("Geometry"))
    radius = w.attribute("radius")
    own = w.switch("FLOAT", radius["Exists"], 1.0, radius["Attribute"])
    scaled = w.math("MULTIPLY", own, w.given("Radius"))
    circle = w.node("GeometryNodeCurvePrimitiveCircle", Resolution=w.given("Sides"), Radius=1.0)
    sweep = w.node("GeometryNodeCurveToMesh", Profile_Curve=circle.outputs["Curve"], Fill_Caps=True)
    link_radius(tree, sweep, curve, scaled)
    # Ends are flat, as a print's are: smooth ones look like dark holes. A tube's sides have four corners.
    corners = w.node("GeometryNodeInputMeshFaceNeighbors").outputs["Vertex Count"]
    sides = w.node("FunctionNodeCompare", {"data_type": "INT", "operation": "EQUAL"}, A=corners, B=4)
    w.output(w.painted(w.smooth(sweep.outputs["Mesh"], sides.outputs["Result"])))


def _balls(tree) -> None:
    """Spheres of radius 1 on points, scaled by `radius`; they take the object's first material."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Detail", "Int", 3, 1, 6, "Subdivisions of a ball")
    w.socket("Material", "Material")
    radius = w.attribute("radius")["Attribute"]
    ball = w.node("GeometryNodeMeshIcoSphere", Radius=1.0, Subdivisions=w.given("Detail"))
    placed = w.node(
        "GeometryNodeInstanceOnPoints",
        Points=w.given("Geometry"),
        Instance=ball.outputs["Mesh"],
        Scale=radius,
    )
    real = w.node("GeometryNodeRealizeInstances", Geometry=placed.outputs["Instances"])
    w.output(w.painted(w.smooth(real.outputs["Geometry"])))


def _labelled(tree, tube_group) -> None:
    """The tubes of `tube_group`, and text in the plane across x."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Label", "String", "", text="Name to write")
    w.socket("At", "Vector", text="Where the name begins")
    w.socket("Size", "Float", 3.0, 0.0, 1000.0, "Height of the letters")
    w.socket("Material", "Material")
    w.socket("In Viewport", "Bool", True, text="Show the name in the viewport, too, not in renders alone")
    own = {"Geometry": w.given("Geometry"), "Material": w.given("Material")}
    tube = w.node("GeometryNodeGroup", {"node_tree": tube_group}, **own)
    written = w.node("GeometryNodeStringToCurves", String=w.given("Label"), Size=w.given("Size"))
    real = w.node("GeometryNodeRealizeInstances", Geometry=written.outputs[0])
    filled = w.node("GeometryNodeFillCurve", Curve=real.outputs["Geometry"])
    upright = (math.pi / 2.0, 0.0, math.pi / 2.0)
    turned = w.node(
        "GeometryNodeTransform", Geometry=filled.outputs["Mesh"], Translation=w.given("At"), Rotation=upright
    )
    painted = w.painted(turned.outputs["Geometry"])
    # Names are drawn over the viewport; the text is for renders.
    viewport = w.node("GeometryNodeIsViewport").outputs[0]
    rendered = w.in_order("FunctionNodeBooleanMath", {"operation": "NOT"}, viewport)
    seen = w.in_order("FunctionNodeBooleanMath", {"operation": "OR"}, w.given("In Viewport"), rendered)
    w.output(w.joined(tube.outputs["Geometry"], w.switch("GEOMETRY", seen, true=painted)))


def _colour_field(tree) -> None:
    """`mu_colour` = (value - Low) / (High - Low), clamped."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Attribute", "String", "value", text="Name of the point attribute, in physical units")
    w.socket("Low", "Float", 0.0, text="Value of the ramp's first colour")
    w.socket("High", "Float", 1.0, text="Value of the ramp's last colour")
    w.socket("Material", "Material", text="Material whose ramp reads `mu_colour`")
    value = w.attribute(w.given("Attribute"))["Attribute"]
    scaled = w.node(
        "ShaderNodeMapRange", {"clamp": True}, Value=value, From_Min=w.given("Low"), From_Max=w.given("High")
    )
    stored = w.node(
        "GeometryNodeStoreNamedAttribute",
        {"data_type": "FLOAT", "domain": "POINT"},
        Geometry=w.given("Geometry"),
        Name="mu_colour",
        Value=scaled.outputs["Result"],
    )
    w.output(w.painted(stored.outputs["Geometry"]))


TUBES = Group(
    "MU Tubes",
    3,
    "Tubes along curves and edges; the point attribute `radius`, or a curve's own, gives their radius",
    _tubes,
)
"""Tubes along edges and curves, their radius from an attribute: struts, paths, users' curves."""
BALLS = Group("MU Balls", 1, "A ball at every point; the point attribute `radius` gives its radius", _balls)
"""A ball at every point, its radius from an attribute: anchors, junctions."""
LABELLED = Group(
    "MU Labelled Tube",
    2,
    "Tubes along edges with a name at a place, to be read from +x",
    _labelled,
    (TUBES.name,),
)
"""A tube with its name next to its lower end: candidate paths, which a click on tube or name selects."""
COLOUR_FIELD = Group(
    "MU Colour Field",
    1,
    "Scales a point attribute from a range to 0 .. 1 and stores it as `mu_colour`, for a material's ramp",
    _colour_field,
)
"""A physical value at the points, scaled to 0 .. 1 for a colour ramp; the value itself is unchanged."""
