"""Runs inside a Blender with a window of 1600 x 900: M, a node's slider, a wrong link, Ctrl G and Tab.

Places within Blender's own popups are as they are in such a window of Blender 5.2.
"""

import os
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from simulated import called, click, drag, key, module, move, over_view, parts, run

FOLDER = Path(os.environ["MU_TEST_FOLDER"])
unit_object, trees = module("blender.unit.object"), module("blender.node_tree.state")


def only():
    (root,) = unit_object.roots()
    return root


def node(label):
    """The node of that name in the only tree."""
    (tree,) = trees.trees()
    return next(n for n in tree.nodes if n.bl_label == label)


def editor():
    """The node editor and its region."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "NODE_EDITOR")
    return area, next(region for region in area.regions if region.type == "WINDOW")


def at(one, right, up):
    """A place on a node in pixels of the window: the share of its width, and lines above its lower edge."""
    _, region = editor()
    scale = bpy.context.preferences.system.ui_scale
    left, top = (scale * v for v in one.location_absolute)
    x, y = region.view2d.view_to_region(left, top, clip=False)
    pixels = (region.view2d.view_to_region(left + 1000, top, clip=False)[0] - x) / 1000
    width, height = one.dimensions
    return region.x + x + right * width * pixels, region.y + y + pixels * (scale * 23.0 * up - height)


def moved_to_a_collection():
    root = only()
    root.mu_unit.candidates = True
    yield 2.0
    middle = over_view()
    yield 1.0
    key("M")
    yield 1.5
    # New Collection, then Create: the first click there ends the writing of its name.
    yield from click(middle[0] - 60, middle[1] - 28)
    for _ in range(2):
        yield from click(middle[0] - 89, middle[1] - 68)
    (collection,) = only().users_collection
    assert collection.name == "Collection 2", collection.name
    shown = {c.name for child in only().children for c in child.users_collection}
    assert shown == {collection.name}, "what shows its paths goes with it"
    only().mu_unit.candidates = False
    yield 1.0


def worked_on_by_nodes():
    assert called(bpy.ops.mu.tree_of_unit, steps=True) == {"FINISHED"}
    (tree,) = trees.trees()
    view = parts()[1]
    view.ui_type = tree.bl_idname
    yield 2.0
    area, region = editor()
    area.spaces.active.node_tree = tree
    yield 1.0
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.node.view_all()
    yield 3.0

    # The wall, the third line from below.
    chambers = node("Chambers")
    field = next(chambers.field_of(s.identifier) for s in chambers.inputs if s.name.startswith("Wall"))
    before = getattr(chambers, field)
    place = at(chambers, 0.6, 2.8)
    yield from drag(place, (place[0] + 20, place[1]))
    dragged = getattr(node("Chambers"), field)
    assert before < dragged < 2.0, (before, dragged)
    assert abs(only().mu_unit.chambers.wall_mm - dragged) < 1e-6, "the unit follows its tree"
    assert not unit_object.behind(only())
    (FOLDER / "dragged.txt").write_text(f"{before:.3f} mm to {dragged:.3f} mm over 20 pixels\n")

    # From the chambers' only output to the profile that the cells take.
    cells = node("Cells")
    yield from drag(
        at(node("Chambers"), 1.0, node("Chambers").dimensions[1] / 24.0 - 1.4), at(cells, 0.0, 3.65)
    )
    found = trees.refresh(tree)[node("Cells").name]
    assert found.error is not None, "no link came of it"
    assert "takes a profile, not a surface" in found.error.what
    move(area.x + 300, area.y + 200)
    yield 1.0
    key("Z", ctrl=True)
    yield 2.0
    (tree,) = trees.trees()
    assert trees.refresh(tree)[node("Cells").name].error is None

    for one in tree.nodes:
        one.select = one.bl_label in ("Trim", "Grading")
    yield 1.0
    number = len(tree.nodes)
    key("G", ctrl=True)
    yield 2.0
    (outer,) = (t for t in trees.trees() if any(n.bl_label == "Chambers" for n in t.nodes))
    (group,) = (n for n in outer.nodes if getattr(n, "node_tree", None) is not None)
    assert {n.bl_label for n in group.node_tree.nodes} >= {"Trim", "Grading"}
    assert len(outer.nodes) == number - 1
    key("TAB")
    yield 2.0
    states = {name: found.state for name, found in trees.refresh(outer).items()}
    assert set(states.values()) <= {"cached", "computed"}, states
    area, region = editor()
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area, region=region):
        bpy.ops.view2d.pan(deltax=5000)
        bpy.ops.mu.tree_new(template="unit")
    yield 4.0
    for one in area.spaces.active.node_tree.nodes:
        x, y = at(one, 0.5, 1.0)
        assert region.x < x < region.x + region.width, "a new tree is framed"
        assert region.y < y < region.y + region.height, "a new tree is framed"
    area.ui_type = "VIEW_3D"
    yield 2.0


def session():
    yield 2.0
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    assert called(bpy.ops.mu.add, preset="mu-0.75x") == {"FINISHED"}
    yield 2.0
    yield from moved_to_a_collection()
    yield from worked_on_by_nodes()


run(session)
