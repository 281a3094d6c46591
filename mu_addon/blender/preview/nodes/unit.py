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
    kind = w.attribute(SKIN, "INT")["Attribute"]

    def those(value: int):
        same = w.node("FunctionNodeCompare", {"data_type": "INT", "operation": "EQUAL"}, A=kind, B=value)
        return w.node(
            "GeometryNodeSeparateGeometry",
            {"domain": "POINT"},
            Geometry=w.given("Geometry"),
            Selection=same.outputs["Result"],
        ).outputs["Selection"]

    def skinned(group, value: int, material: str, **inputs):
        own = {"Geometry": those(value), "Material": w.given(material), **inputs}
        return w.node("GeometryNodeGroup", {"node_tree": group}, **own).outputs["Geometry"]

    struts = skinned(tube_group, TUBE, "Struts", Sides=w.given("Sides"))
    joints = skinned(ball_group, NODE, "Struts", Detail=2)
    anchors = skinned(ball_group, BALL, "Anchors", Detail=w.given("Detail"))
    # The mesh's own slots stay the first ones.
    both = w.joined(anchors, joints, struts, those(PLAIN))
    # Their meshes, with colours and materials: an instance of a hidden object would not be drawn.
    shape = {"transform_space": "ORIGINAL"}
    found = [w.node("GeometryNodeObjectInfo", shape, Object=w.given(n), As_Instance=False) for n in RESULTS]
    played = w.joined(*(node.outputs["Geometry"] for node in found))
    # Brought into another file it may have lost them: then the design is seen, and never nothing.
    size = w.node("GeometryNodeAttributeDomainSize", {"component": "MESH"}, Geometry=played)
    there = w.node(
        "FunctionNodeCompare",
        {"data_type": "INT", "operation": "GREATER_THAN"},
        A=size.outputs["Point Count"],
        B=0,
    )
    w.output(w.switch("GEOMETRY", there.outputs["Result"], both, played))


UNIT = Group(NAME, _VERSION, _TEXT, _build, (TUBES.name, BALLS.name))
