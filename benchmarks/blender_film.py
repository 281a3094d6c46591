"""The film of the whole way: runs inside a Blender with a window, where the built extension is installed.

    MU_FILM=FOLDER MU_TEST_FOLDER=FOLDER MU_BLENDER_UI... benchmarks/blender_film.py last.png SECONDS

(MU_BLENDER_UI as of tests/blender/test_installed.py; it needs ImageMagick's `import`.)
From an empty scene to a unit that bends while it is shaped, its paths ranked quickly, the painted deviation
and the motion: each step by the extension's own operators, a picture of the whole window after it. Blender
itself makes `film.webm` of them. What takes minutes, the simulation, is seen at some of its moments. In
background (`blender -b -P benchmarks/blender_film.py`) the film is made anew of the pictures in MU_FILM.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "blender"))

FOLDER = Path(os.environ["MU_FILM"])
RUNS = os.environ.get("MU_FILM_RUNS", "")
"""Folder of the same unit's runs, if an earlier session was cut off: what it finished is taken up."""
RATE = 6
SIZE = 1280, 720
SHOTS = "shots.json"
"""Names of the pictures, and how many seconds each is seen."""
shots = []


def shot(hold_s):
    """A picture of the whole screen, to be seen so long; Blender's own are black where no card draws it."""
    file = FOLDER / f"shot{len(shots):03d}.png"
    subprocess.run(["import", "-window", "root", str(file)], check=True)
    shots.append((file.name, hold_s))
    (FOLDER / SHOTS).write_text(json.dumps(shots))
    print("shot", file.name, flush=True)


def root():
    return unit_object.roots()[0]


def shape():
    yield 4.0
    for other in list(bpy.data.objects):
        bpy.data.objects.remove(other)
    parts()[1].spaces.active.show_region_ui = True
    yield 4.0
    parts()[2].active_panel_category = "MU"
    yield 4.0
    shot(1.0)
    assert called(bpy.ops.mu.add, preset="mu-1.0x") == {"FINISHED"}
    yield 6.0
    viewports.frame([root()])
    yield 4.0
    shot(1.5)


def bend():
    """The unit bends while it is designed: pressures, walls, and its stretch in colours."""
    live = root().mu_live
    live.pressure_kPa, live.on = 0.0, True
    yield from bent()
    for kPa in range(0, 41, 4):
        live.pressure_kPa = kPa
        yield 1.5
        shot(0.2)
    for wall in (1.0, 1.1):
        root().mu_unit.chambers.wall_mm = wall
        yield 3.0
        shot(0.4)
        yield from bent()
        shot(0.8)
    live.colour = "largest_stretch"
    while bending.of(root()).shape is None or not bending.of(root()).shape.fields:
        yield 0.5
    yield 2.0
    shot(1.2)
    for kPa in (10.0, 20.0, 30.0, 40.0):
        live.pressure_kPa = kPa
        yield 1.5
        shot(0.3)
    live.colour = "plain"
    live.on = False
    root().mu_unit.chambers.wall_mm = 0.9
    yield 4.0


def bent():
    """Wait for all pressures of the coarse shape."""
    yield 2.0
    while bending.of(root()).shape is None or len(bending.of(root()).shape.pressure_kPa) < 5:
        yield 0.5
    yield 2.0


def path():
    props = root().mu_unit
    props.cut = True
    yield 5.0
    shot(1.2)
    props.candidates = True
    yield 5.0
    shot(1.2)
    assert called(bpy.ops.mu.path, name="alpha4") == {"FINISHED"}
    yield 4.0
    shot(1.2)


def simulate():
    study = root().mu_unit.study
    study.command = "place"
    if RUNS:
        study.folder = RUNS
    stage = ""
    while jobs.running():
        # Of the session before, which was cut off.
        (child,) = (job.child for job in jobs.running())
        yield 2.0
        if child.progress.get("stage") != stage:
            stage = child.progress.get("stage")
            shot(0.6)
    assert called(bpy.ops.mu.simulate, quick=True) == {"FINISHED"}
    child = SIMULATION.child(root())
    stage = ""
    while child.state in ("running", "waiting"):
        yield 2.0
        now = str(child.progress.get("stage", ""))
        if now != stage:
            stage = now
            shot(0.5)
    assert child.state == "done", child.error
    yield 3.0
    shot(1.0)


def results():
    props = root().mu_unit
    props.candidates = True
    yield 4.0
    shot(1.5)
    props.candidates = False
    called(bpy.ops.mu.field_show, field="deviation_mm")
    yield 6.0
    shot(2.0)
    scene = bpy.context.scene
    last = scene.frame_end
    for k in range(16):
        scene.frame_set(1 + round(k * (last - 1) / 15))
        yield 1.0
        shot(0.25)
    called(bpy.ops.mu.field_show, field="von_mises_kPa")
    yield 5.0
    shot(2.0)
    called(bpy.ops.mu.motion_clear)
    yield 4.0
    shot(1.5)


def film():
    """film.webm of the pictures, by Blender's sequencer."""
    scene = bpy.data.scenes.new("film")
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    at = 1
    for name, hold_s in json.loads((FOLDER / SHOTS).read_text()):
        length = max(round(hold_s * RATE), 1)
        strip = strips.new_image(name, str(FOLDER / name), 1, at)
        strip.frame_final_duration = length
        # Pictures are as large as the screen, and a strip shows them so.
        picture = bpy.data.images.load(str(FOLDER / name))
        strip.transform.scale_x = strip.transform.scale_y = SIZE[0] / picture.size[0]
        bpy.data.images.remove(picture)
        at += length
    render = scene.render
    scene.frame_start, scene.frame_end = 1, at - 1
    render.fps, render.resolution_x, render.resolution_y = RATE, *SIZE
    scene.view_settings.view_transform = "Standard"
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "VIDEO"
    render.image_settings.file_format = "FFMPEG"
    render.ffmpeg.format, render.ffmpeg.codec = "WEBM", "WEBM"
    render.ffmpeg.constant_rate_factor, render.ffmpeg.gopsize = "MEDIUM", 60
    render.ffmpeg.audio_codec = "NONE"
    render.use_file_extension = False
    render.filepath = str(FOLDER / "film.webm")
    bpy.ops.render.render(animation=True, scene=scene.name)
    print("film", (FOLDER / "film.webm").stat().st_size, flush=True)


def session():
    for part in (shape, bend, path, simulate, results):
        yield from part()
    film()


if bpy.app.background:
    # Of the pictures that are there.
    film()
else:
    from simulated import called, module, parts, run

    unit_object, jobs = module("blender.unit.object"), module("blender.jobs.start_child")
    bending, viewports = module("blender.live_bending.state"), module("blender.shared.viewports")
    SIMULATION = module("blender.simulate.job").SIMULATION
    run(session)
