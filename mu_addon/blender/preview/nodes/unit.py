"""A unit's one mesh, skinned: struts as tubes, anchors as balls, everything else as it is."""

from __future__ import annotations

from . import balls, tubes
from .wiring import Wiring

NAME = "MU Unit"
VERSION = 1
TEXT = "The mesh of a Monolithic Unit: the point attribute `mu_skin` says what becomes a tube or a ball"
USES = (tubes.NAME, balls.NAME)
PLAIN, TUBE, BALL = 0, 1, 2
"""Values of the point attribute `mu_skin`."""


def build(tree, tube_group, ball_group) -> None:
    """Parts of the mesh by `mu_skin`, each through its group, joined."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Sides", "Int", 8, 3, 64, "Flat pieces around a strut")
    w.socket("Detail", "Int", 3, 1, 6, "Subdivisions of an anchor's ball")
    w.socket("Struts", "Material", text="Material of the struts")
    w.socket("Anchors", "Material", text="Material of the anchors")
    kind = w.node("GeometryNodeInputNamedAttribute", {"data_type": "INT"}, Name="mu_skin").outputs[0]

    def those(value: int):
        same = w.node("FunctionNodeCompare", {"data_type": "INT", "operation": "EQUAL"}, B=value)
        tree.links.new(kind, next(s for s in same.inputs if s.enabled and s.name == "A"))
        return w.node(
            "GeometryNodeSeparateGeometry",
            {"domain": "POINT"},
            Geometry=w.given("Geometry"),
            Selection=same.outputs["Result"],
        ).outputs["Selection"]

    struts = w.node("GeometryNodeGroup", {"node_tree": tube_group})
    anchors = w.node("GeometryNodeGroup", {"node_tree": ball_group})
    for node, value, detail, material in (
        (struts, TUBE, "Sides", "Struts"),
        (anchors, BALL, "Detail", "Anchors"),
    ):
        tree.links.new(those(value), node.inputs["Geometry"])
        tree.links.new(w.given(detail), node.inputs[detail])
        tree.links.new(w.given(material), node.inputs["Material"])
    both = w.node("GeometryNodeJoinGeometry")
    # A join takes the last link first: the mesh's own slots stay the first ones.
    for geometry in (anchors.outputs["Geometry"], struts.outputs["Geometry"], those(PLAIN)):
        tree.links.new(geometry, both.inputs[0])
    w.output(both.outputs[0])
