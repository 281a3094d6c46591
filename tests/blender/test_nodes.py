"""Node groups: built in code, usable on anyone's geometry, renewed in place when they are old."""

from .session import blender, needs_bpy

pytestmark = needs_bpy

EDGES = """
import numpy as np
from mu_addon.blender import nodes
from mu_addon.blender.compat import modifier_input, set_modifier_input


def edge(length, radius=None):
    mesh = bpy.data.meshes.new("edge")
    mesh.from_pydata([(0, 0, 0), (0, 0, length)], [(0, 1)], [])
    if radius is not None:
        mesh.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", radius)
    obj = bpy.data.objects.new("edge", mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def skinned(obj):
    bpy.context.view_layer.update()
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    return np.array([v.co[:] for v in mesh.vertices])

"""


def session(code, tmp_path):
    from .session import PRELUDE

    return blender(code, tmp_path, prelude=PRELUDE + EDGES)


def test_tubes_take_their_radius_from_the_attribute_or_the_input(tmp_path):
    session(
        """
        tapered = edge(10.0, [1.0, 3.0])
        nodes.skin(tapered, "MU Tubes")
        points = skinned(tapered)
        wide = np.hypot(points[:, 0], points[:, 1])
        assert np.allclose(wide[points[:, 2] < 1], 1.0, atol=1e-5)
        assert np.allclose(wide[points[:, 2] > 9], 3.0, atol=1e-5)

        plain = edge(10.0)
        modifier = nodes.skin(plain, "MU Tubes")
        assert nodes.skin(plain, "MU Tubes") == modifier and len(plain.modifiers) == 1
        set_modifier_input(modifier, "Radius", 2.0)
        set_modifier_input(modifier, "Sides", 12)
        assert modifier_input(modifier, "Sides") == 12
        points = skinned(plain)
        assert len(points) == 24
        assert np.allclose(np.hypot(points[:, 0], points[:, 1]), 2.0, atol=1e-5)
        try:
            set_modifier_input(modifier, "no such input", 1)
        except KeyError:
            pass
        else:
            raise AssertionError
        """,
        tmp_path,
    )


def test_a_colour_field_scales_a_value(tmp_path):
    session(
        """
        obj = edge(10.0)
        obj.data.attributes.new("stress_kPa", "FLOAT", "POINT").data.foreach_set("value", [5.0, 30.0])
        modifier = nodes.skin(obj, "MU Colour Field")
        for name, value in {"Attribute": "stress_kPa", "Low": 0.0, "High": 20.0}.items():
            set_modifier_input(modifier, name, value)
        bpy.context.view_layer.update()
        mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        colour = [a.value for a in mesh.attributes["mu_colour"].data]
        assert np.allclose(colour, [0.25, 1.0])
        assert [a.value for a in mesh.attributes["stress_kPa"].data] == [5.0, 30.0]
        """,
        tmp_path,
    )


def test_an_old_group_is_renewed_in_place(tmp_path):
    session(
        """
        obj = edge(10.0, [1.0, 1.0])
        modifier = nodes.skin(obj, "MU Tubes")
        tree = modifier.node_group
        set_modifier_input(modifier, "Sides", 11)
        before = skinned(obj)
        tree["mu_version"] = 0
        tree.nodes.clear()
        assert nodes.group("MU Tubes") == tree == modifier.node_group
        assert tree["mu_version"] == nodes.GROUPS["MU Tubes"].VERSION
        assert modifier_input(modifier, "Sides") == 11
        assert len(before) == 22 and np.allclose(skinned(obj), before)
        assert all(nodes.group(name).asset_data is not None for name in nodes.GROUPS)
        assert len(bpy.data.node_groups) == len(nodes.GROUPS)
        """,
        tmp_path,
    )


def test_a_group_that_is_there_is_not_built_again(tmp_path):
    session(
        """
        first = nodes.group("MU Tubes")
        first.nodes["Group Output"].location.x = 1234.0
        assert nodes.group("MU Tubes").nodes["Group Output"].location.x == 1234.0
        """,
        tmp_path,
    )
