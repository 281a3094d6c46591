"""A tube with its name beside its lower end: candidate paths, which a click on tube or name selects."""

from __future__ import annotations

import math

from . import tubes
from .wiring import Wiring

NAME = "MU Labelled Tube"
VERSION = 2
TEXT = "Tubes along edges with a name at a place, to be read from +x"
USES = (tubes.NAME,)


def build(tree, tube_group) -> None:
    """The tubes of `tube_group`, and text in the plane across x."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Label", "String", "", text="Name to write")
    w.socket("At", "Vector", text="Where the name begins")
    w.socket("Size", "Float", 3.0, 0.0, 1000.0, "Height of the letters")
    w.socket("Material", "Material")
    w.socket("In Viewport", "Bool", True, text="Show the name in the viewport, too, not in renders alone")
    tube = w.node("GeometryNodeGroup", {"node_tree": tube_group})
    tree.links.new(w.given("Geometry"), tube.inputs["Geometry"])
    tree.links.new(w.given("Material"), tube.inputs["Material"])
    written = w.node("GeometryNodeStringToCurves", String=w.given("Label"), Size=w.given("Size"))
    real = w.node("GeometryNodeRealizeInstances", Geometry=written.outputs[0])
    filled = w.node("GeometryNodeFillCurve", Curve=real.outputs["Geometry"])
    upright = (math.pi / 2.0, 0.0, math.pi / 2.0)
    turned = w.node(
        "GeometryNodeTransform", Geometry=filled.outputs["Mesh"], Translation=w.given("At"), Rotation=upright
    )
    painted = w.node(
        "GeometryNodeSetMaterial", Geometry=turned.outputs["Geometry"], Material=w.given("Material")
    )
    # Names are drawn over the viewport; the text is for renders.
    rendered = w.node("FunctionNodeBooleanMath", {"operation": "NOT"})
    tree.links.new(w.node("GeometryNodeIsViewport").outputs[0], rendered.inputs[0])
    seen = w.node("FunctionNodeBooleanMath", {"operation": "OR"})
    tree.links.new(w.given("In Viewport"), seen.inputs[0])
    tree.links.new(rendered.outputs[0], seen.inputs[1])
    named = w.node("GeometryNodeSwitch", {"input_type": "GEOMETRY"}, Switch=seen.outputs[0])
    tree.links.new(
        painted.outputs["Geometry"], next(s for s in named.inputs if s.enabled and s.name == "True")
    )
    both = w.node("GeometryNodeJoinGeometry")
    # A join takes the last link first; the order does not matter here.
    tree.links.new(tube.outputs["Geometry"], both.inputs[0])
    tree.links.new(named.outputs[0], both.inputs[0])
    w.output(both.outputs[0])
