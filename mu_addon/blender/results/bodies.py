"""The analysis mesh of a motion, by region, as objects whose shape is set: beside a unit or in its place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np

from ...report.motion_files import REGIONS, Motion
from ..preview import skeletons
from ..shared import displays


def skins_of(motion: Motion, cut: bool) -> dict[str, Any]:
    """Surface of each region; cut: of a half."""
    return {region: motion.skin(region, cut) for region in REGIONS}


def of_motion(motion: Motion, skins: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Vertices (s, v, 3) in mm at each state of Model A and triangles (t, 3), of surfaces by region."""
    vertices = {
        region: (skin.of_nodes(motion.mesh.nodes) + skin.of_nodes(motion.model_a)).astype(np.float32)
        for region, skin in skins.items()
    }
    return vertices, {region: skin.triangles for region, skin in skins.items()}


def put(
    root: Any, mark: str, title: str, vertices: Mapping[str, Any], triangles: Mapping[str, Any]
) -> list[Any]:
    """Displays of a mark, one a region, with vertices (v, 3); those that are there are taken; return them."""
    found = []
    for region in REGIONS:
        part = displays.part(root, mark, region)
        if part is None:
            part = displays.add(root, mark, region, bpy.data.meshes.new(f"{title} {region}"))
            displays.lock(part)
        size = [len(vertices[region]), len(triangles[region])]
        if list(part.data.get("mu_size", ())) != size:
            skeletons.write(part.data, skeletons.Skeleton(vertices[region], faces=(triangles[region],)))
            part.data["mu_size"] = size
        found.append(part)
    return found


def move(part: Any, vertices: Any) -> bool:
    """Give a display's mesh other vertices (v, 3) in mm; return False if it has another number of them."""
    if len(part.data.vertices) != len(vertices):
        return False
    part.data.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(vertices).ravel())
    part.data.update()
    return True
