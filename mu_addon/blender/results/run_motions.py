"""Motions of a unit's runs, read from their files, and their difference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import MuError
from ...usecases.simulate_and_place.motion import FOLDER, MODEL_A, Motion, read_motion
from ...usecases.simulate_and_place.run_difference import difference
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies

_motions: FileCache[Motion] = FileCache()
_apart: dict[Any, tuple[Motion, Motion, Any, str]] = {}
"""By both folders, motion and cut: both motions, the distances, and words on them."""
_words: dict[str, str] = {}
"""By UUID of the unit: words on the last difference."""


def motion_of(root: Any) -> Motion | None:
    """Motion of the shown run, or None; read again when it changes."""
    return motion_in(studies.results_folder(root))


def motion_in(folder: Path) -> Motion | None:
    """Motion in a run's folder, likewise."""
    return _motions.read([folder / FOLDER / f"{MODEL_A}.npz"], lambda: read_motion(folder))


def apart(root: Any, motion: Motion, name: str, region: str, cut: bool) -> Any | None:
    """Distance (s, v) in mm to the motion of the compared run; None without one.

    Of a region's surface, cut open or not; `difference_words` has the reason if it is missing.
    """
    run = studies.run_by_key(root, root.mu_unit.study.against)
    other = None if run is None else motion_in(run.folder)
    if other is None:
        _words[root.mu_unit.uuid] = "Compare with another run first, one with a motion"
        return None
    if other.folder == motion.folder:
        _words[root.mu_unit.uuid] = "The shown run is the one that it is compared with: tick another one"
        return None
    key = motion.folder, other.folder, f"{name}|{region}", cut
    kept = _apart.get(key)
    if kept is None or kept[0] is not motion or kept[1] is not other:
        try:
            found = difference(motion, name, motion.skin(region, cut), other, name)
        except MuError as error:
            kept = motion, other, None, error.what
        else:
            words = (
                f"{found.unknown:.0%} of the surface is not in the other unit: grey" if found.unknown else ""
            )
            kept = motion, other, found.distance_mm, words
        _apart[key] = kept
    _words[root.mu_unit.uuid] = kept[3]
    return kept[2]


def difference_words(root: Any) -> str:
    """Words on the difference to another run: why there is none, or how much."""
    return _words.get(root.mu_unit.uuid, "")


def clear() -> None:
    """Empty the caches."""
    for kept in (_motions, _apart, _words):
        kept.clear()
