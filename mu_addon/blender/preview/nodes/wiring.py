"""A short notation for node groups: sockets, nodes side by side, links."""

from __future__ import annotations

from typing import Any


class Wiring:
    """Builds one group: `socket` and `output` for its interface, `node` for the nodes between."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self._inputs = None
        self._x = 0
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")

    def socket(
        self, name: str, kind: str, default: Any = None, low: Any = None, high: Any = None, text: str = ""
    ):
        """Add an input of `kind` ("Geometry", "Int", "Float", "String", ...) to the group."""
        item = self.tree.interface.new_socket(name, in_out="INPUT", socket_type=f"NodeSocket{kind}")
        item.description = text
        for attribute, value in (("default_value", default), ("min_value", low), ("max_value", high)):
            if value is not None:
                setattr(item, attribute, value)

    def given(self, name: str):
        """The socket of an input, to link from."""
        if self._inputs is None:
            self._inputs = self.node("NodeGroupInput")
        return self._inputs.outputs[name]

    def node(self, kind: str, settings: dict[str, Any] | None = None, **inputs: Any):
        """Add a node; `settings`: of the node; `inputs`: values, or sockets to link from.

        A name in `inputs` has _ for a space.
        """
        node = self.tree.nodes.new(kind)
        node.location = (self._x, 0.0)
        self._x += 200
        for name, value in (settings or {}).items():
            setattr(node, name, value)
        for name, value in inputs.items():
            (socket, *_) = (s for s in node.inputs if s.enabled and s.name == name.replace("_", " "))
            self._set(socket, value)
        return node

    def _set(self, socket: Any, value: Any) -> None:
        """Give an input a value, or link it from a socket."""
        if hasattr(value, "is_output"):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def curves(self, geometry: Any):
        """Every curve of a geometry, and the edges of its mesh as curves."""
        parts = self.node("GeometryNodeSeparateComponents", Geometry=geometry)
        edges = self.node("GeometryNodeMeshToCurve", Mesh=parts.outputs["Mesh"])
        return self.joined(parts.outputs["Curve"], edges.outputs["Curve"])

    def attribute(self, name: Any, kind: str = "FLOAT"):
        """Values of a named attribute, and True where it exists."""
        return self.node("GeometryNodeInputNamedAttribute", {"data_type": kind}, Name=name).outputs

    def joined(self, *geometries: Any):
        """Several geometries as one, the last first: a join takes the last link first."""
        both = self.node("GeometryNodeJoinGeometry")
        for geometry in geometries:
            self.tree.links.new(geometry, both.inputs[0])
        return both.outputs[0]

    def math(self, operation: str, *values: Any):
        """A number from one or two others, each a socket or a value."""
        return self.in_order("ShaderNodeMath", {"operation": operation}, *values)

    def switch(self, kind: str, condition: Any, false: Any = None, true: Any = None):
        """One of two values of a kind by a condition; None for an input that stays empty."""
        given = {name: value for name, value in (("False", false), ("True", true)) if value is not None}
        return self.node("GeometryNodeSwitch", {"input_type": kind}, Switch=condition, **given).outputs[0]

    def in_order(self, kind: str, settings: dict[str, Any], *values: Any):
        """The output of a node whose inputs, not told apart by their names, are given in their order."""
        node = self.node(kind, settings)
        for socket, value in zip(node.inputs, values, strict=False):
            self._set(socket, value)
        return node.outputs[0]

    def painted(self, geometry: Any, material: str = "Material"):
        """A geometry in the material of an input."""
        given = self.given(material)
        return self.node("GeometryNodeSetMaterial", Geometry=geometry, Material=given).outputs["Geometry"]

    def smooth(self, mesh: Any, selection: Any = None):
        """The mesh, shaded smooth; the node's first input is called Geometry before 5.0 and Mesh since.

        selection: a socket that selects faces; the others are flat, with sharp edges around them.
        """
        node = self.node("GeometryNodeSetShadeSmooth")
        self.tree.links.new(mesh, node.inputs[0])
        if selection is not None:
            self.tree.links.new(selection, node.inputs["Shade Smooth"])
        return node.outputs[0]

    def output(self, geometry: Any) -> None:
        """End the group with a geometry."""
        self.node("NodeGroupOutput", Geometry=geometry)
