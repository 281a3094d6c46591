"""Physical fields in colour: their names, and the material whose ramp shows them.

The attribute keeps its values and its unit; the material scales it to its ramp, so that another range or
other colours change no data.
"""

from __future__ import annotations

from typing import Any

import attrs
import bpy
import numpy as np

from ..preview import materials

STOPS = (
    (0.267, 0.005, 0.329),
    (0.279, 0.175, 0.483),
    (0.230, 0.322, 0.546),
    (0.173, 0.449, 0.558),
    (0.128, 0.567, 0.551),
    (0.158, 0.684, 0.502),
    (0.369, 0.789, 0.383),
    (0.678, 0.864, 0.190),
    (0.993, 0.906, 0.144),
)
"""Initial colours of the ramp, sRGB, which the user may change; as numbers, since matplotlib loads slowly."""
TABLE = 128
"""Number of distinct colours in solid shading."""
COLOUR = "mu_field_colour"
"""Colour attribute of solid shading; renders and material preview use the material."""
_PLAIN = "MU Solid"
RARE = 0.2
"""Percent of a field's values, at either end, that the range ignores: at edges stress is unbounded."""


@attrs.frozen
class Field:
    """A field: its attribute, its name, its unit and its description.

    amount: colours begin at 0; rare: percent of its values, at either end, that the range ignores; spots: 0
    except at few locations, which alone set the range.
    """

    name: str
    label: str
    unit: str
    text: str
    amount: bool = False
    rare: float = RARE
    spots: bool = False

    @property
    def title(self) -> str:
        """Its name, with its unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def ends(self, values: Any) -> tuple[float, float]:
        """The range of values (s, v) over the whole motion without its rarest, NaN left out."""
        if self.spots:
            values = values[values > 0.0]
            if not len(values):
                return 0.0, 0.0
        low, high = np.nanpercentile(values, (self.rare, 100.0 - self.rare))
        return 0.0 if self.amount else float(low), float(high)


FIELDS = (
    Field("displacement_mm", "Displacement", "mm", "Distance from the point's position at rest", amount=True),
    Field(
        "deviation_mm",
        "Deviation",
        "mm",
        "Distance between the unit with the sensor and without it, point by point",
        amount=True,
    ),
    Field(
        "von_mises_kPa", "Von Mises Stress", "kPa", "Of Cauchy's stress, averaged at the nodes", amount=True
    ),
    Field(
        "largest_principal_stress_kPa",
        "Largest Principal Stress",
        "kPa",
        "Of Cauchy's stress, tension positive, averaged at the nodes",
    ),
    Field("largest_stretch", "Largest Stretch", "", "Largest principal stretch"),
    Field("smallest_stretch", "Smallest Stretch", "", "Smallest principal stretch"),
    Field(
        "contact_pressure_kPa",
        "Self-Contact Pressure",
        "kPa",
        "Between walls and struts that touch each other, without a sensor; simulated with self-contact",
        amount=True,
        rare=5.0,
        spots=True,
    ),
    Field(
        "run_difference_mm",
        "Difference of Runs",
        "mm",
        "Distance between the positions of a point in this run and in the run compared with it",
        amount=True,
    ),
    Field(
        "dJ_by_modulus_mm_per_MPa",
        "Sensitivity dJ/dE",
        "mm/MPa",
        "How much the motion changes if only the material there is stiffened, without a sensor",
    ),
)
BY_NAME = {field.name: field for field in FIELDS}


def material_of(root: Any) -> Any:
    """Material that colours a unit's fields, made if it is missing."""
    name = f"MU Field {root.mu_unit.uuid[:8]}"
    return bpy.data.materials.get(name) or _make(name)


def _make(name: str) -> Any:
    made = bpy.data.materials.new(name)
    if made.node_tree is None:  # before 5.0
        made.use_nodes = True
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    value = tree.nodes.new("ShaderNodeAttribute")
    value.name, value.attribute_type = "Field", "GEOMETRY"
    scaled = tree.nodes.new("ShaderNodeMapRange")
    scaled.name, scaled.clamp = "Range", True
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.name = "Ramp"
    for node, place in ((value, -900), (scaled, -700), (ramp, -500)):
        node.location = (place, 200)
    elements = ramp.color_ramp.elements
    last = len(STOPS) - 1
    for number in range(len(STOPS)):
        at = number / last
        element = elements[0] if number == 0 else elements[-1] if number == last else elements.new(at)
        element.color = of_map(at)
    tree.links.new(value.outputs["Fac"], scaled.inputs["Value"])
    tree.links.new(scaled.outputs["Result"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.7
    made.diffuse_color = (0.13, 0.57, 0.55, 1.0)
    return made


def legend_material_of(root: Any) -> Any:
    """Material of a unit's legend in the scene: the field's present ramp, by `share`, unlit."""
    name = f"MU Legend {root.mu_unit.uuid[:8]}"
    made = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    materials.shining(made)
    tree = made.node_tree
    share, ramp = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeValToRGB")
    share.attribute_name, share.attribute_type = "share", "GEOMETRY"
    _copy_ramp(material_of(root).node_tree.nodes["Ramp"].color_ramp, ramp.color_ramp)
    tree.links.new(share.outputs["Fac"], ramp.inputs["Fac"])
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(ramp.outputs["Color"], emission.inputs["Color"])
    return made


def _copy_ramp(source: Any, target: Any) -> None:
    target.interpolation, target.color_mode = source.interpolation, source.color_mode
    while len(target.elements) > 1:
        target.elements.remove(target.elements[-1])
    for number, element in enumerate(source.elements):
        own = target.elements.new(element.position) if number else target.elements[0]
        own.position, own.color = element.position, element.color


def of_map(share: float) -> tuple[float, float, float, float]:
    """Linear colour at a share 0 .. 1 of the map that reports use, too."""
    places = np.linspace(0.0, 1.0, len(STOPS))
    r, g, b = (float(np.interp(share, places, column)) for column in zip(*STOPS, strict=True))
    return _linear(r), _linear(g), _linear(b), 1.0


def _linear(srgb: float) -> float:
    return srgb / 12.92 if srgb <= 0.04045 else ((srgb + 0.055) / 1.055) ** 2.4


def colours(root: Any, values: Any, ends: tuple[float, float] | None = None) -> Any:
    """The ramp's colours (v, 4), linear, of values (v,) of a field; ends: its range, else the motion's."""
    low, high = ends or (root.mu_motion.low, root.mu_motion.high)
    ramp = material_of(root).node_tree.nodes["Ramp"].color_ramp
    table = np.array([ramp.evaluate(share) for share in np.linspace(0.0, 1.0, TABLE)], np.float32)
    share = (values - low) / max(high - low, 1e-30)
    return table[np.clip(share * TABLE, 0, TABLE - 1).astype(np.int32)]


def paint(root: Any, parts: list[tuple[Any, bool]]) -> None:
    """Set range and field of a unit's material, and give it to the parts that carry the field."""
    settings = root.mu_motion
    found = material_of(root)
    set_range(found, settings.field, (settings.low, settings.high))
    for part, carries in parts:
        materials.wear(part.data, found if carries else materials.material(_PLAIN))


def set_range(material: Any, field: str, ends: tuple[float, float]) -> None:
    """Let a material that `material_of` made colour an attribute over a range."""
    nodes = material.node_tree.nodes
    # What is set already is left: each write makes Blender build the material anew, at every step of a drag.
    if nodes["Field"].attribute_name != field:
        nodes["Field"].attribute_name = field
    for name, value in zip(("From Min", "From Max"), ends, strict=True):
        socket = nodes["Range"].inputs[name]
        if socket.default_value != np.float32(value):
            socket.default_value = value


def write_colours(root: Any, mesh: Any, values: Any | None, ends: tuple[float, float] | None = None) -> None:
    """Write a field's values (v,) as colours for solid shading; plain without one, and at NaN.

    ends: range of the field, else the motion's.
    """
    plain = np.float32(materials.COLOURS[_PLAIN])
    if values is None:
        found = np.broadcast_to(plain, (len(mesh.vertices), 4))
    else:
        found = colours(root, np.nan_to_num(values), ends)
        found[np.isnan(values)] = plain
    set_colours(mesh, found)


def set_colours(mesh: Any, colours: Any) -> None:
    """Give a mesh's points colours (v, 4), linear, which solid shading shows."""
    attribute = mesh.color_attributes.get(COLOUR) or mesh.color_attributes.new(COLOUR, "FLOAT_COLOR", "POINT")
    attribute.data.foreach_set("color", np.ascontiguousarray(colours).ravel())
    if mesh.color_attributes.active_color_name != COLOUR:
        mesh.color_attributes.active_color_name = COLOUR
