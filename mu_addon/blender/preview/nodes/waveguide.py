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
    bar = w.painted(sweep.outputs["Mesh"])

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
    # A little less than the pitch, so that rounding does not lower the count: points are spread evenly.
    places = w.node(
        "GeometryNodeCurveToPoints",
        {"mode": "LENGTH"},
        Curve=part.outputs["Curve"],
        Length=w.math("MULTIPLY", w.given("Pitch"), 0.9999),
    )
    axes = {"primary_axis": "Z", "secondary_axis": "X"}
    normal = w.attribute("mu_normal", "FLOAT_VECTOR")["Attribute"]
    turn = w.in_order("FunctionNodeAxesToRotation", axes, places.outputs["Tangent"], normal)
    # Beyond the face that it opens, so that no two faces coincide.
    over = w.math("MULTIPLY", w.given("Section"), 0.04)
    tall = w.math("ADD", w.given("Well Depth"), over)
    wide = w.math("ADD", w.given("Section"), over)
    size = w.node("ShaderNodeCombineXYZ", X=tall, Y=wide, Z=w.given("Well Width"))
    box = w.node("GeometryNodeMeshCube", Size=size.outputs["Vector"])
    # From the axis outward to the face, less half the well, plus the margin.
    lift = w.math("SUBTRACT", w.math("ADD", half, over), w.math("MULTIPLY", tall, 0.5))
    up = w.node("ShaderNodeCombineXYZ", X=lift)
    lifted = w.node("GeometryNodeTransform", Geometry=box.outputs["Mesh"], Translation=up.outputs["Vector"])
    wells = w.node(
        "GeometryNodeInstanceOnPoints",
        Points=places.outputs["Points"],
        Instance=lifted.outputs["Geometry"],
        Rotation=turn,
    )
    real = w.node("GeometryNodeRealizeInstances", Geometry=wells.outputs["Instances"])
    shown = w.painted(real.outputs["Geometry"], "Wells")
    cut = w.node("GeometryNodeMeshBoolean", {"operation": "DIFFERENCE"}, Mesh_1=bar, Mesh_2=shown)
    w.output(w.switch("GEOMETRY", w.given("Cut"), w.joined(bar, shown), cut.outputs["Mesh"]))


WAVEGUIDE = Group(NAME, _VERSION, _TEXT, _build)
