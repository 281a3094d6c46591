"""Candidate paths by what the study found: J and rank of each, and the colour and label of its tube."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..results import field_colours
from ..shared.compat import set_modifier_input
from ..shared.texts import path_symbol
from ..simulate import study_folder as studies


def ranked(root: Any) -> dict[str, tuple[float, int]]:
    """J_hat in mm and rank, from 1, of every path by name; empty without results or where they are stale."""
    found = studies.findings(root)
    if found is None or found.stale:
        return {}
    return {name: (j, rank) for rank, (name, j) in enumerate(found.ranking(found.rule), 1)}


def free(root: Any) -> tuple[str, float, Any] | None:
    """Name, J_hat in mm and points (h, 3) in mm of the whole lattice's best path; None if not known."""
    found = studies.findings(root)
    best = None if found is None or found.stale else (found.summary.get("search") or {}).get("best")
    return (best["name"], best["J_hat_mm"], np.array(best["points_mm"])) if best else None


def colour_and_label(root: Any, candidates: dict[str, Any]) -> None:
    """Colour and label candidate tubes, objects by path; the chosen one keeps its colour."""
    known = ranked(root)
    if not known:
        return
    values = [j for j, _ in known.values()]
    low, high = min(values), max(values)
    for name, tube in candidates.items():
        if name not in known:
            continue
        j, rank = known[name]
        modifier = tube.modifiers[0]
        # Below the name: side by side the tubes have no room for more.
        label = f"{path_symbol(name)}\n#{rank}"
        set_modifier_input(modifier, "Label", label)
        if name != root.mu_unit.path:
            share = ((j - low) / (high - low)) ** 0.5 if high > low else 0.0
            colour = _material(f"MU J {root.mu_unit.uuid[:8]} {name}", field_colours.of_map(share))
            tube.data.materials[0] = colour
            set_modifier_input(modifier, "Material", colour)


def _material(name: str, colour: tuple[float, ...]) -> Any:
    found = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    found.diffuse_color = colour
    shader = found.node_tree.nodes.get("Principled BSDF") if found.node_tree else None
    if shader is not None:
        shader.inputs["Base Color"].default_value = colour
    return found
