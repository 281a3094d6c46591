"""A physical value at the points, scaled to 0 .. 1 for a colour ramp; the value itself stays as it is."""

from __future__ import annotations

from .wiring import Wiring

NAME = "MU Colour Field"
VERSION = 1
TEXT = "Scales a point attribute from a range to 0 .. 1 and stores it as `mu_colour`, for a material's ramp"


def build(tree) -> None:
    """`mu_colour` = (value - Low) / (High - Low), clamped."""
    w = Wiring(tree)
    w.socket("Geometry", "Geometry")
    w.socket("Attribute", "String", "value", text="Name of the point attribute, in physical units")
    w.socket("Low", "Float", 0.0, text="Value of the ramp's first colour")
    w.socket("High", "Float", 1.0, text="Value of the ramp's last colour")
    w.socket("Material", "Material", text="Material whose ramp reads `mu_colour`")
    value = w.node("GeometryNodeInputNamedAttribute", {"data_type": "FLOAT"}, Name=w.given("Attribute"))
    scaled = w.node(
        "ShaderNodeMapRange",
        {"clamp": True},
        Value=value.outputs["Attribute"],
        From_Min=w.given("Low"),
        From_Max=w.given("High"),
    )
    stored = w.node(
        "GeometryNodeStoreNamedAttribute",
        {"data_type": "FLOAT", "domain": "POINT"},
        Geometry=w.given("Geometry"),
        Name="mu_colour",
        Value=scaled.outputs["Result"],
    )
    painted = w.node(
        "GeometryNodeSetMaterial", Geometry=stored.outputs["Geometry"], Material=w.given("Material")
    )
    w.output(painted.outputs["Geometry"])
