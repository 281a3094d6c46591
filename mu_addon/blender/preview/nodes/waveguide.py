"""A square bar along a user's curves, with wells in one face at a constant pitch."""

from __future__ import annotations

import math

from ...shared.compat import link_radius
from .groups import Group
from .wiring import Wiring

NAME = "MU Waveguide"
_VERSION = 1
_TEXT = (
    "A square bar along curves and edges, with wells at a constant pitch in the face the curve's normal shows"
)


def _build(tree) -> None:
    """A square swept along the curve, with boxes at every pitch, cut out of it or shown in it.

    The wells rotate with the curve's normal; their number follows its length.
    """
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Section", "Float", 1.5, 0.01, 100.0, "Side of the bar's square section")
    w.socket("Pitch", "Float", 3.125, 0.05, 1000.0, "Distance between wells along the curve")
    w.socket("Well Width", "Float", 1.0, 0.0, 100.0, "Width of a well along the curve")
    w.socket("Well Depth", "Float", 0.65, 0.0, 100.0, "Depth of a well")
    w.socket("Cut", "Bool", True, text="Cut the wells out; else show them as boxes")
    w.socket("Material", "Material", text="Material of the bar")
    w.socket("Wells", "Material", text="Material of the wells")
    curve = w.curves(w.given("Geometry"))

    half = w.math("MULTIPLY", w.given("Section"), 0.5)
    # A circle of four points is a square of that radius; on its edge it has its sides along the normal.
    diagonal = w.math("MULTIPLY", half, math.sqrt(2.0))
    ring = w.node("GeometryNodeCurvePrimitiveCircle", Resolution=4, Radius=1.0)
    square = w.node(
        "GeometryNodeTransform", Geometry=ring.outputs["Curve"], Rotation=(0.0, 0.0, math.pi / 4.0)
    )
    sweep = w.node("GeometryNodeCurveToMesh", Profile_Curve=square.outputs["Geometry"], Fill_Caps=True)
    link_radius(tree, sweep, curve, diagonal)
    bar = w.node("GeometryNodeSetMaterial", Geometry=sweep.outputs["Mesh"], Material=w.given("Material"))

    # The part with the wells: whole pitches, centred on each curve, half a pitch or more from its ends.
    # Normals are captured from the whole curve, since those of a part may differ.
    length = w.node("GeometryNodeSplineLength").outputs["Length"]
    gaps = w.math("FLOOR", w.math("SUBTRACT", w.math("DIVIDE", length, w.given("Pitch")), 1.0))
    reach = w.math("MULTIPLY", w.math("MAXIMUM", gaps, 0.0), w.given("Pitch"))
    start = w.math("MULTIPLY", w.math("SUBTRACT", length, reach), 0.5)
    marked = w.node(
        "GeometryNodeStoreNamedAttribute",
        {"data_type": "FLOAT_VECTOR", "domain": "POINT"},
        Geometry=curve,
        Name="mu_normal",
        Value=w.node("GeometryNodeInputNormal").outputs["Normal"],
    )
    part = w.node(
        "GeometryNodeTrimCurve",
        {"mode": "LENGTH"},
        Curve=marked.outputs["Geometry"],
        Start=start,
        End=w.math("ADD", start, w.math("MAXIMUM", reach, 1e-3)),
    )
    # A little less than the pitch, so that rounding does not lower the count; points are spread evenly
    # anyway.
    places = w.node(
        "GeometryNodeCurveToPoints",
        {"mode": "LENGTH"},
        Curve=part.outputs["Curve"],
        Length=w.math("MULTIPLY", w.given("Pitch"), 0.9999),
    )
    normal = w.node("GeometryNodeInputNamedAttribute", {"data_type": "FLOAT_VECTOR"}, Name="mu_normal")
    turn = w.node("FunctionNodeAxesToRotation", {"primary_axis": "Z", "secondary_axis": "X"})
    w.tree.links.new(places.outputs["Tangent"], turn.inputs[0])
    w.tree.links.new(normal.outputs["Attribute"], turn.inputs[1])
    # Beyond the face that it opens, so that no two faces coincide.
    over = w.math("MULTIPLY", w.given("Section"), 0.04)
    tall = w.math("ADD", w.given("Well Depth"), over)
    size = w.node("ShaderNodeCombineXYZ")
    for name, value in (
        ("X", tall),
        ("Y", w.math("ADD", w.given("Section"), over)),
        ("Z", w.given("Well Width")),
    ):
        tree.links.new(value, size.inputs[name])
    box = w.node("GeometryNodeMeshCube", Size=size.outputs["Vector"])
    # From the axis outward to the face, less half the well, plus the margin.
    lift = w.math("SUBTRACT", w.math("ADD", half, over), w.math("MULTIPLY", tall, 0.5))
    up = w.node("ShaderNodeCombineXYZ")
    tree.links.new(lift, up.inputs["X"])
    lifted = w.node("GeometryNodeTransform", Geometry=box.outputs["Mesh"], Translation=up.outputs["Vector"])
    wells = w.node(
        "GeometryNodeInstanceOnPoints",
        Points=places.outputs["Points"],
        Instance=lifted.outputs["Geometry"],
        Rotation=turn.outputs["Rotation"],
    )
    real = w.node("GeometryNodeRealizeInstances", Geometry=wells.outputs["Instances"])
    shown = w.node("GeometryNodeSetMaterial", Geometry=real.outputs["Geometry"], Material=w.given("Wells"))
    cut = w.node("GeometryNodeMeshBoolean", {"operation": "DIFFERENCE"})
    tree.links.new(bar.outputs["Geometry"], cut.inputs["Mesh 1"])
    tree.links.new(shown.outputs["Geometry"], cut.inputs["Mesh 2"])
    both = w.node("GeometryNodeJoinGeometry")
    for part in (bar, shown):
        tree.links.new(part.outputs["Geometry"], both.inputs[0])
    chosen = w.node(
        "GeometryNodeSwitch",
        {"input_type": "GEOMETRY"},
        Switch=w.given("Cut"),
        False_=both.outputs[0],
        True_=cut.outputs["Mesh"],
    )
    w.output(chosen.outputs[0])


WAVEGUIDE = Group(NAME, _VERSION, _TEXT, _build)
