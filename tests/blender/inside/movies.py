"""A movie as a camera writes it, for `test_tracking`."""

import bpy


def write_movie(shots, movie):
    """H.264 of the pictures shot*.png in a folder, 25 a second."""
    scene = bpy.context.scene
    names = sorted(path.name for path in shots.glob("*.png"))
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strip = strips.new_image("bench", str(shots / names[0]), 1, 1)
    for name in names[1:]:
        strip.elements.append(name)
    scene.frame_end, scene.render.fps, scene.view_settings.view_transform = len(names), 25, "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 360, 340
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "VIDEO"
    settings.file_format, scene.render.filepath = "FFMPEG", str(movie)
    scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "MPEG4", "H264"
    scene.render.ffmpeg.constant_rate_factor = "HIGH"
    bpy.ops.render.render(animation=True)
