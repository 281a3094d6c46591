"""Runs inside a Blender with a window of 1600 x 900: some seventy gestures on units, trees, runs and results.

How long anything of the extension held the window, and what, is written to blocked.json in MU_TEST_FOLDER.
With MU_HEARTBEAT it is how long anything held it, Blender's own work and drawing too: the longest time
between two beats of a timer, by gesture (benchmarks/heartbeat.py).
"""

import json
import os
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from simulated import called, drag, dragged_in_redo_panel, key, module, over_view, package, parts, run

FOLDER = Path(os.environ["MU_TEST_FOLDER"])
unit_object, trees = module("blender.unit.object"), module("blender.node_tree.state")
stack = module("blender.unit.stack")
handles, printing = module("blender.scene.handles"), module("blender.printing.state")
results = module("blender.results.motion")
studies, OPTIMIZATION = module("blender.simulate.study_folder"), module("blender.optimize.state").OPTIMIZATION
classes, scene_units = module("blender.node_tree.classes"), module("blender.shared.scene_units")
SIMULATION = module("blender.simulate.job").SIMULATION
bending, viewports = module("blender.live_bending.state"), module("blender.shared.viewports")
OURS = str(Path(sys.modules[package].__file__).parent)
DIGITS = {"ZERO": "0", "ONE": "1", "TWO": "2", "NINE": "9"}
done = []


class Blocked:
    """Seconds of the processor in every call from Blender into the extension, by function and gesture."""

    def __init__(self):
        self.longest, self.calls, self.gesture = {}, 0, "start"
        self._depth, self._entered, self._name = 0, 0.0, ""

    def __call__(self, frame, event, argument):
        if event == "call":
            if self._depth or frame.f_code.co_filename.startswith(OURS):
                if not self._depth:
                    self._name = f"{Path(frame.f_code.co_filename).stem}.{frame.f_code.co_qualname}"
                    self._entered = time.thread_time()
                self._depth += 1
        elif event == "return" and self._depth:
            self._depth -= 1
            if not self._depth:
                self.calls += 1
                place = self._name, self.gesture
                self.longest[place] = max(self.longest.get(place, 0.0), time.thread_time() - self._entered)


class Pulse:
    """Longest time between two beats of a timer in each gesture, by the clock and by the processor."""

    EVERY_S = 0.005

    def __init__(self):
        self.longest, self.beats, self.gesture = {}, 0, "start"
        self._last = None

    def __call__(self):
        self.beat()
        return self.EVERY_S

    def beat(self):
        """The time since the last beat belongs to the present gesture."""
        now = time.perf_counter(), time.thread_time()
        if self._last is not None:
            clock, processor = (b - a for a, b in zip(self._last, now, strict=True))
            before = self.longest.get(self.gesture, (0.0, 0.0))
            self.longest[self.gesture] = max(before[0], clock), max(before[1], processor)
            self.beats += 1
        self._last = now


HEARTBEAT = bool(os.environ.get("MU_HEARTBEAT"))
blocked = Pulse() if HEARTBEAT else Blocked()


def gesture(name):
    """The name of what is done next."""
    done.append(name)
    if HEARTBEAT:
        blocked.beat()
    blocked.gesture = name
    print(f"{len(done)}. {name}", flush=True)


def roots():
    return unit_object.roots()


def only():
    (root,) = roots()
    return root


def select(*objects):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[-1]


def typed(*keys, **rest):
    """Keys over the view, then a moment for Blender."""
    over_view()
    yield 0.25
    for name in keys:
        digit = {"unicode": DIGITS[name]} if name in DIGITS else {}
        key(name, **digit, **rest)
        yield 0.25
    yield 0.6


def until(condition):
    """What follows a gesture is a few frames behind it, and a frame may take seconds."""
    for _ in range(300):
        if condition():
            return
        yield 0.3
    assert condition(), blocked.gesture


def settled():
    yield from until(lambda: not any(unit_object.behind(root) for root in roots()))


def wall():
    return only().mu_unit.chambers.wall_mm


def by_mouse_and_keys():
    """A unit from the menu by its name, its wall by a drag in the sidebar; each one undo step."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    parts()[1].spaces.active.show_region_ui = True
    yield 3.0
    parts()[2].active_panel_category = "MU"
    yield 2.0
    gesture('Shift A, "mono", Return')
    over_view()
    yield 2.0
    key("A", shift=True)
    yield 3.0
    for letter in "mono":
        key(letter.upper(), unicode=letter)
        yield 1.5
    key("RET")
    yield 5.0
    assert bpy.context.scene.unit_settings.scale_length == 1.0, "the scene's unit is the user's"
    assert abs(only().dimensions.z - 0.081) < 1e-3, "and the unit has its true size in it"
    gesture("a wall dragged in the sidebar")
    region = parts()[2]
    # The panel as it first opens; a few rows up and down where fonts differ.
    for rows in (0, -1, 1, -2, 2, 3):
        start = region.x + 175, region.y + region.height - 450 + 20 * rows
        built = only().mu_unit.built
        yield from drag(start, (start[0] + 24, start[1]), pause=1.2)
        if abs(wall() - 0.9) > 1e-4:
            break
        if only().mu_unit.built != built:
            key("Z", ctrl=True)  # another parameter
            yield 3.0
    yield from settled()
    dragged = wall()
    assert abs(dragged - 0.9) > 1e-4, "no slider was found"
    gesture("both undone and done again")
    yield from typed("Z", ctrl=True)
    assert abs(wall() - 0.9) < 1e-6
    yield from typed("Z", ctrl=True)
    assert roots() == [], "adding a unit is more than one undo step"
    for _ in range(2):
        yield from typed("Z", ctrl=True, shift=True)
    assert abs(wall() - dragged) < 1e-6
    yield from settled()
    assert list(only().children) == []
    gesture("a step muted, and undone")
    assert called(bpy.ops.mu.mute, step="cells") == {"FINISHED"}
    yield 2.0
    assert "cells" in stack.muted(only().mu_unit)
    yield from typed("Z", ctrl=True)
    assert stack.muted(only().mu_unit) == frozenset()
    called(bpy.ops.mu.delete)
    yield 1.0


def on_a_unit():
    gesture("add")
    assert called(bpy.ops.mu.add, preset="mu-0.75x") == {"FINISHED"}
    yield 1.0
    root = only()
    height, at = root.dimensions.z, root.location.x

    gesture("G, move along X")
    yield from typed("G", "X", "ONE", "RET")
    assert abs(only().location.x - at - 1.0) < 1e-6
    assert abs(only().dimensions.z - height) < 1e-6
    gesture("R, turn about Z")
    yield from typed("R", "Z", "NINE", "ZERO", "RET")
    assert abs(only().rotation_euler.z) > 1.0
    gesture("S does nothing")
    before = tuple(only().scale)
    yield from typed("S", "TWO", "RET")
    assert tuple(only().scale) == before
    gesture("Ctrl Z")
    yield from typed("Z", ctrl=True)
    gesture("Ctrl Shift Z")
    yield from typed("Z", ctrl=True, shift=True)
    only()

    gesture("a wall dragged in the redo panel")
    before = only().mu_unit.chambers.wall_mm
    assert called(bpy.ops.mu.chambers, "INVOKE_DEFAULT") == {"FINISHED"}
    yield 1.0
    yield from dragged_in_redo_panel(lambda: abs(only().mu_unit.chambers.wall_mm - before) > 1e-4)
    assert abs(only().mu_unit.chambers.wall_mm - before) > 1e-4, "no field was found in the redo panel"

    gesture("Shift D")
    yield from typed("D", shift=True)
    yield from typed("ESC")
    assert len(roots()) == 2
    first, second = sorted(roots(), key=lambda r: r.name)
    assert first.mu_unit.uuid != second.mu_unit.uuid
    assert first.data != second.data
    gesture("a slider of the copy")
    second.mu_unit.chambers.count = 4
    yield from settled()
    yield from until(lambda: second.dimensions.z < 0.8 * first.dimensions.z)
    gesture("X deletes the copy")
    select(second)
    yield from typed("X", "RET")
    for _ in range(3):
        if len(roots()) == 1:
            break
        # Without a question, or with one that Return has answered: by the preferences.
        called(bpy.ops.object.delete)
        yield 1.0
    assert [r.name for r in roots()] == [first.name]

    gesture("Alt D")
    select(only())
    yield from typed("D", alt=True)
    yield from typed("ESC")
    assert len({r.mu_unit.uuid for r in roots()}) == 2
    assert len({r.data.name for r in roots()}) == 2, "a linked duplicate is independent"
    gesture("undo of Alt D")
    yield from typed("Z", ctrl=True)
    while len(roots()) > 1:
        yield from typed("Z", ctrl=True)
    gesture("rename")
    only().name = "arm"
    yield 1.0
    assert only().mu_unit.title == "arm"
    gesture("H hides")
    select(only())
    yield from typed("H")
    assert only().hide_get()
    gesture("Alt H shows")
    yield from typed("H", alt=True)
    assert not only().hide_get()
    gesture("parent")
    empty = bpy.data.objects.new("base", None)
    bpy.context.collection.objects.link(empty)
    only().parent = empty
    yield 1.0
    gesture("move by the parent")
    at = only().matrix_world.translation.copy()
    empty.location.z += 0.1
    bpy.context.view_layer.update()
    assert (only().matrix_world.translation - at).length > 0.09
    only().parent = None
    gesture("another collection")
    collection = bpy.data.collections.new("arms")
    bpy.context.scene.collection.children.link(collection)
    root = only()
    for held in list(root.users_collection):
        held.objects.unlink(root)
    collection.objects.link(root)
    yield 1.0
    assert unit_object.active_root(bpy.context) == root
    gesture("candidates shown")
    root.mu_unit.candidates = True
    yield from until(lambda: len(only().children) == 10)
    gesture("a candidate deleted by force comes back")
    bpy.data.objects.remove(root.children[0])
    yield from until(lambda: len(only().children) == 10)
    gesture("candidates hidden")
    only().mu_unit.candidates = False
    yield from until(lambda: len(only().children) == 0)


def in_other_scenes():
    units = bpy.context.scene.unit_settings
    for name, system, scale in (
        ("metres", "METRIC", 1.0),
        ("millimetres", "METRIC", 0.001),
        ("inches", "IMPERIAL", 1.0),
    ):
        gesture(f"a scene of {name}")
        units.system, units.scale_length = system, scale
        yield 0.7
        mm = scene_units.mm(bpy.context.scene)
        yield from until(lambda mm=mm: abs(only().dimensions.z / mm - 0.75 * 81.0) < 1.0)
    units.system, units.scale_length = "METRIC", 1.0
    yield 1.0


def in_files():
    gesture("save")
    assert called(bpy.ops.wm.save_as_mainfile, filepath=str(FOLDER / "arm.blend")) == {"FINISHED"}
    yield 1.0
    gesture("reopen")
    uuid = only().mu_unit.uuid
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "arm.blend"))
    yield 1.0
    assert only().mu_unit.uuid == uuid
    gesture("append")
    # Blender loads nothing from the file that is open.
    called(bpy.ops.wm.save_as_mainfile, filepath=str(FOLDER / "kept.blend"), copy=True)
    with bpy.data.libraries.load(str(FOLDER / "kept.blend")) as (there, here):
        here.objects = [name for name in there.objects if name == "arm"]
    (appended,) = here.objects
    bpy.context.scene.collection.objects.link(appended)
    yield 1.0
    assert len({r.mu_unit.uuid for r in roots()}) == 2
    gesture("pasted into a scene of millimetres")
    window, area, _ = parts()
    metres, millimetres = bpy.context.scene, bpy.data.scenes.new("millimetres")
    millimetres.unit_settings.scale_length = 0.001
    select(roots()[0])
    called(bpy.ops.view3d.copybuffer)
    window.scene = millimetres
    yield 0.7
    called(bpy.ops.view3d.pastebuffer)
    yield from until(lambda: len(roots()) == 3)
    view = area.spaces.active.region_3d
    yield from until(lambda: view.view_distance > millimetres.objects[0].dimensions.z > 50.0)
    bpy.data.objects.remove(millimetres.objects[0])
    window.scene = metres
    bpy.data.scenes.remove(millimetres)
    yield 0.7
    viewports.frame(roots())
    gesture("two units: the active one is worked on")
    for root in roots():
        select(root)
        assert unit_object.active_root(bpy.context) == root
    gesture("link")
    called(bpy.ops.object.delete)
    with bpy.data.libraries.load(str(FOLDER / "kept.blend"), link=True) as (there, here):
        here.objects = ["arm"]
    bpy.context.scene.collection.objects.link(here.objects[0])
    yield 0.7
    assert len(roots()) == 1, "a linked unit is its own file's"
    select(here.objects[0])
    bpy.data.objects.remove(here.objects[0])
    select(only())
    yield 1.0


def in_trees():
    gesture("a tree from a template")
    assert called(bpy.ops.mu.tree_new, template="three-walls") == {"FINISHED"}
    (tree,) = trees.trees()
    yield 0.7
    assert len(roots()) == 4, "its three walls are in the scene, beside the unit that was there"
    found = trees.refresh(tree)
    motions = [n for n in tree.nodes if n.bl_label == "Simulate"]
    assert {found[n.name].state for n in motions} == {"waiting"}
    gesture("a value")
    walls = [n for n in tree.nodes if n.bl_label == "Set Parameter"]
    before = {n.name: found[n.name].key for n in walls}
    walls[0].value = 0.82
    yield 0.7
    after = trees.refresh(tree)
    assert [after[n.name].key != before[n.name] for n in walls] == [True, False, False]
    gesture("a wrong link")
    compare = next(n for n in tree.nodes if n.bl_label == "Compare")
    study = next(s for s in motions[0].inputs if s.identifier == "unit")
    right = study.links[0].from_socket
    wrong = tree.links.new(study, compare.outputs[0])
    yield 0.7
    assert trees.refresh(tree)[motions[0].name].error is not None
    gesture("the link mended")
    tree.links.remove(next(x for x in tree.links if x.to_socket == study))
    del wrong
    tree.links.new(study, right)
    yield 0.7
    assert trees.refresh(tree)[motions[0].name].error is None
    gesture("a node muted")
    walls[1].mute = True
    yield 0.7
    assert trees.refresh(tree)[walls[1].name].state in ("muted", "computed", "cached")
    walls[1].mute = False
    gesture("an obstacle linked")
    obstacle = tree.nodes.new(classes.node_class("obstacle"))
    tree.links.new(next(s for s in motions[0].inputs if s.identifier == "obstacles"), obstacle.outputs[0])
    yield 0.7
    assert "no body is named" in trees.refresh(tree)[obstacle.name].error.what
    tree.nodes.remove(obstacle)
    yield 0.7
    assert trees.refresh(tree)[motions[0].name].state == "waiting"
    gesture("a run of the tree")
    child = trees.start(tree, (motions[0].name,))
    yield 2.0
    assert trees.RUN.is_running(tree)
    assert child.estimate.count == 1
    yield from until(lambda: child.estimate.seconds_left is not None)
    gesture("an undo while it runs")
    yield from typed("Z", ctrl=True)
    yield from typed("Z", ctrl=True, shift=True)
    gesture("its Cancel")
    child.cancel()
    for _ in range(60):
        if child.state not in ("running", "waiting"):
            break
        yield 0.5
    assert child.state == "cancelled", (child.state, child.error)
    for node in next(trees.trees()).nodes:
        if getattr(node, "follower", None) is not None:
            select(node.follower)
            called(bpy.ops.mu.delete)
    yield 0.7


def while_running():
    root = only()
    select(root)
    root.mu_unit.study.command = "simulate"
    gesture("Simulate")
    assert called(bpy.ops.mu.simulate) == {"FINISHED"}
    child = SIMULATION.child(root)
    yield 2.0
    assert child.state == "running", child.error
    gesture("playback while running")
    called(bpy.ops.screen.animation_play)
    yield 2.0
    called(bpy.ops.screen.animation_cancel)
    gesture("a slider while running")
    root.mu_unit.chambers.wall_mm = 0.95
    yield from settled()
    assert child.state == "running", child.error
    gesture("undo and redo across the run")
    yield from typed("Z", ctrl=True)
    yield from typed("Z", ctrl=True, shift=True)
    gesture("delete while running")
    select(only())
    called(bpy.ops.mu.delete)
    yield 0.7
    assert roots() == []
    assert child.state == "running", child.error
    gesture("undo brings it back")
    yield from typed("Z", ctrl=True)
    root = only()
    assert SIMULATION.child(root) is child
    gesture("Cancel")
    select(root)
    assert called(bpy.ops.mu.cancel) == {"FINISHED"}
    for _ in range(60):
        if child.state != "running":
            break
        yield 0.5
    assert child.state == "cancelled", (child.state, child.error)


def while_bending():
    root = only()
    select(root)
    root.mu_unit.chambers.count = 3
    yield from settled()
    gesture("a frame and nothing else")
    for _ in range(10):
        viewports.redraw()
        yield 0.1
    gesture("Bend")
    viewports.frame([root])
    root.mu_live.on = True
    yield from bent(root)
    assert viewports.holds(parts()[1], viewports.corners(bending.parts(root))), "it is longer than at rest"
    gesture("the pressure dragged")
    for kPa in range(0, 41, 2):
        root.mu_live.pressure_kPa = kPa
        yield 0.05
    gesture("Stretch painted")
    root.mu_live.colour = "largest_stretch"
    yield from until(lambda: bending.of(only()).shape is not None and bending.of(only()).shape.fields)
    gesture("the pressure dragged, painted")
    for kPa in range(0, 41, 2):
        root.mu_live.pressure_kPa = kPa
        yield 0.05
    gesture("a wall while bent")
    root.mu_unit.chambers.wall_mm = 0.98
    yield from until(lambda: bending.of(only()).current is None)
    yield from bent(root)
    gesture("Bend off")
    root.mu_live.on = False
    yield 0.5


def bent(root):
    def is_bent():
        shape = bending.of(root).current
        return shape is not None and len(shape.pressure_kPa) > 4

    yield from until(is_bent)


def ended(child):
    """Until a job has ended, in minutes, and what shows it has been drawn."""
    while child.state in ("running", "waiting"):
        yield 0.3
    yield 2.0


def pressed(operator, shown, **settings):
    """A button pressed, which may first prepare its result in a process of its own, until it shows."""
    called(operator, "INVOKE_DEFAULT", **settings)
    yield from until(shown)
    yield 1.5


def painted(field):
    """True once the colours of a shown motion are those of a field."""
    motion = only().mu_motion
    return motion.field == field and any(field in part.data.attributes for part in results.parts(only()))


def with_results():
    """Two walls simulated: fields, a difference, the solid, the print, a search; each button as a user's."""
    root = only()
    (FOLDER / "press.csv").write_text("time_s,pressure_kPa\n0,0\n2,-5\n4,20\n")
    study = root.mu_unit.study
    study.protocol, study.refine = str(FOLDER / "press.csv"), 0.35
    for wall in (1.1, 0.98):
        root.mu_unit.chambers.wall_mm = wall
        yield from settled()
        gesture(f"a run from its start to its end, wall {wall} mm")
        called(bpy.ops.mu.simulate, "INVOKE_DEFAULT")
        child = SIMULATION.child(root)
        yield from ended(child)
        assert child.state == "done", child.error
    shown = studies.shown_run(root)
    other = next(run.key for run in studies.runs_of(root) if run.key != shown.key)
    for name in ("displacement_mm", "von_mises_kPa", "contact_pressure_kPa"):
        gesture(f"{name} shown")
        yield from pressed(bpy.ops.mu.field_show, lambda name=name: painted(name), field=name)
    gesture("frames of the motion")
    for frame in range(1, bpy.context.scene.frame_end, 6):
        bpy.context.scene.frame_set(frame)
        yield 0.1
    gesture("the pressure of a result")
    for kPa in range(-5, 21, 2):
        handles.to_pressure(root, bpy.context.scene, float(kPa))
        yield 0.1
    gesture("Compare")
    yield from pressed(bpy.ops.mu.run_compare, lambda: study.against == other, key=other)
    gesture("Difference shown")
    difference = "run_difference_mm"
    yield from pressed(bpy.ops.mu.field_show, lambda: painted(difference), field=difference)
    gesture("Clear Motion")
    yield from pressed(bpy.ops.mu.motion_clear, lambda: not results.shown(root))
    gesture("Build Solid")
    yield from pressed(bpy.ops.mu.solid, lambda: unit_object.solid_is_current(only()))
    gesture("the moving print")
    yield from pressed(bpy.ops.mu.motion, lambda: ("model_a", "print") in results.shown(root), what="print")
    gesture("its frames")
    for frame in range(1, bpy.context.scene.frame_end, 12):
        bpy.context.scene.frame_set(frame)
        yield 0.1
    called(bpy.ops.mu.motion_clear, "INVOKE_DEFAULT")
    for name, operator in (("Check Print", bpy.ops.mu.print_check), ("Export", bpy.ops.mu.print_export)):
        gesture(name)
        called(operator, "INVOKE_DEFAULT")
        yield from ended(printing.PRINTING.child(root))
    gesture("Optimize")
    for what in ("targets", "freedoms"):
        called(bpy.ops.mu.optimize_list, "INVOKE_DEFAULT", what=what)
    called(bpy.ops.mu.optimize, "INVOKE_DEFAULT")
    child = OPTIMIZATION.child(root)
    yield 3.0
    assert child.state == "running", child.error
    gesture("its end by Cancel")
    child.cancel()
    yield from ended(child)
    assert child.state == "cancelled", (child.state, child.error)


def session():
    yield 2.0
    if HEARTBEAT:
        bpy.app.timers.register(blocked, persistent=True)
    else:
        sys.setprofile(blocked)
    try:
        for part in (
            by_mouse_and_keys,
            on_a_unit,
            in_other_scenes,
            in_files,
            in_trees,
            while_running,
            while_bending,
            with_results,
        ):
            yield from part()
        assert len(done) >= 65, len(done)
    finally:
        sys.setprofile(None)
        told = {"gestures": done}
        if HEARTBEAT:
            told |= {"beats": blocked.beats, "longest_s": blocked.longest}
        else:
            worst = sorted(((s, *place) for place, s in blocked.longest.items()), reverse=True)
            told |= {"calls": blocked.calls, "longest_s": worst[:12]}
        (FOLDER / "blocked.json").write_text(json.dumps(told, indent=1))


run(session)
