"""A unit's one mesh, skinned: struts as tubes, anchors as balls, everything else unchanged.

Or, on the unit itself, the objects that play a study's motion in its place. A click on them selects the unit,
and moving the unit moves them.
"""

from __future__ import annotations

from .groups import BALLS, TUBES, Group
from .wiring import Wiring

NAME = "MU Unit"
_VERSION = 4
_TEXT = "The mesh of a Monolithic Unit: the point attribute `mu_skin` says what becomes a tube or a ball"
RESULTS = ("Result 1", "Result 2")
"""Inputs for the objects shown in place of the mesh, if any is given that has a shape."""
SKIN = "mu_skin"
PLAIN, TUBE, BALL, NODE = 0, 1, 2, 3
"""A point attribute and its values; a node is a coarser ball of the struts' material."""


def _build(tree, tube_group, ball_group) -> None:
    """Parts of the mesh by `mu_skin`, each through its group, joined."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Sides", "Int", 8, 3, 64, "Flat pieces around a strut")
    w.socket("Detail", "Int", 3, 1, 6, "Subdivisions of an anchor's ball")
    w.socket("Struts", "Material", text="Material of the struts")
    w.socket("Anchors", "Material", text="Material of the anchors")
    for name in RESULTS:
        w.socket(name, "Object", text="Object that plays a study's motion")
    kind = w.node("GeometryNodeInputNamedAttribute", {"data_type": "INT"}, Name=SKIN).outputs[0]

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
    joints = w.node("GeometryNodeGroup", {"node_tree": ball_group}, Detail=2)
    anchors = w.node("GeometryNodeGroup", {"node_tree": ball_group})
    for node, value, detail, material in (
        (struts, TUBE, "Sides", "Struts"),
        (joints, NODE, "", "Struts"),
        (anchors, BALL, "Detail", "Anchors"),
    ):
        tree.links.new(those(value), node.inputs["Geometry"])
        if detail:
            tree.links.new(w.given(detail), node.inputs[detail])
        tree.links.new(w.given(material), node.inputs["Material"])
    both = w.node("GeometryNodeJoinGeometry")
    # A join takes the last link first: the mesh's own slots stay the first ones.
    for geometry in (*(n.outputs["Geometry"] for n in (anchors, joints, struts)), those(PLAIN)):
        tree.links.new(geometry, both.inputs[0])
    played = w.node("GeometryNodeJoinGeometry")
    for name in RESULTS:
        # Its mesh, with colours and materials: an instance of a hidden object would not be drawn.
        found = w.node(
            "GeometryNodeObjectInfo", {"transform_space": "ORIGINAL"}, Object=w.given(name), As_Instance=False
        )
        tree.links.new(found.outputs["Geometry"], played.inputs[0])
    # Brought into another file it may have lost them: then the design is seen, and never nothing.
    size = w.node("GeometryNodeAttributeDomainSize", {"component": "MESH"}, Geometry=played.outputs[0])
    there = w.node(
        "FunctionNodeCompare",
        {"data_type": "INT", "operation": "GREATER_THAN"},
        A=size.outputs["Point Count"],
        B=0,
    )
    chosen = w.node("GeometryNodeSwitch", {"input_type": "GEOMETRY"}, Switch=there.outputs["Result"])
    tree.links.new(both.outputs[0], next(s for s in chosen.inputs if s.enabled and s.name == "False"))
    tree.links.new(played.outputs[0], next(s for s in chosen.inputs if s.enabled and s.name == "True"))
    w.output(chosen.outputs[0])


UNIT = Group(NAME, _VERSION, _TEXT, _build, (TUBES.name, BALLS.name))
