"""The clip editor's operators: markers as the user places them, tracked and written as measured data."""

import bpy
import numpy as np

from mu_addon.blender.track import properties as bench
from mu_addon.blender.track import state as tracking
from mu_addon.blender.unit import object as unit_object
from mu_addon.measured import read_folder
from mu_addon.measured.bench import MarkerSettings

from .acting import add, refused


def editor(clip):
    """The clip in a Movie Clip Editor."""
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.ui_type = "CLIP_EDITOR"
    area.spaces.active.clip = clip
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)


def test_the_clip_editors_operators(tmp_path, filmed):
    """Markers as the user places them, roles chosen in the sidebar, saved and loaded, written twice."""
    truth, angles = filmed
    at = {name: (float(x), float(y)) for name, (x, y) in zip("abcd", truth[:, 0], strict=True)}
    add()
    clip = bpy.data.movieclips.load(str(tmp_path / "clip" / "shot0001.png"))
    with editor(clip):
        assert not bpy.ops.mu.track.poll()
        assert not bpy.ops.mu.track_write.poll()
        assert "Place markers first" in bench.missing(clip)
        for name, pixel in at.items():
            tracking._place(clip, name, pixel, MarkerSettings({}), "")
        assert bpy.ops.mu.track() == {"FINISHED"}
    settings = clip.mu_bench
    settings.base_1 = "a"
    assert "Base: choose two" in bench.missing(clip)
    settings.base_2, settings.tip_1, settings.tip_2 = "b", "c", "d"
    assert "Give the places" in bench.missing(clip)
    settings.base_1_mm, settings.base_2_mm = (-15, 0), (15, 0)
    assert "frames per second" in bench.missing(clip)
    settings.fps = 10
    assert "pressure" in bench.missing(clip)
    settings.pressure = str(tmp_path / "pressure.csv")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "bench.blend"))
    assert "folder to write into" in bench.missing(clip)
    settings.folder = "//measured"
    settings.title, settings.role, settings.specimen = "by hand", "held_out", "B"
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "bench.blend"))
    (clip,) = bpy.data.movieclips
    assert clip.mu_bench.tip_2 == "d"
    assert not bench.missing(clip)
    with editor(clip):
        assert bpy.ops.mu.track_write() == {"FINISHED"}
    assert unit_object.active_root(bpy.context).mu_evidence.folder == "//measured"
    assert bpy.ops.mu.track_write(clip=clip.name) == {"FINISHED"}
    clip.mu_bench.tip_2 = "c"
    assert "Tip: choose two" in refused(bpy.ops.mu.track_write, clip=clip.name)
    assert "There is no clip" in refused(bpy.ops.mu.track_write, clip="none")
    (e,) = read_folder(tmp_path / "measured").experiments
    assert (e.name, e.role, e.specimen) == ("by hand", "held_out", "B")
    assert np.abs(e["angle_deg"] - angles).max() < 0.1
