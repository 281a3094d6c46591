"""Motions of a unit's runs, read from their files, and their difference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import MuError
from ...fem.embedding import Embedding
from ...report.motion_files import FOLDER, MODEL_A, REGIONS, Motion, read_motion
from ...run.cache import key
from ...simulate_and_place.run_difference import difference
from ..jobs import prepared
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies

_motions: FileCache[Motion] = FileCache()
_apart: dict[Any, tuple[Motion, Motion, Any, str]] = {}
"""By both folders, motion and cut: both motions, the distances, and a text on them."""
_words: dict[str, str] = {}
"""By UUID of the unit: text on the last difference."""


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
    place = motion.folder, other.folder, f"{name}|{region}", cut
    kept = _apart.get(place)
    if kept is None or kept[0] is not motion or kept[1] is not other:
        if not prepared.at_once():
            raise _wanted(root, motion, name, other, cut)
        try:
            found = difference(motion, name, motion.skin(region, cut), other, name)
        except MuError as error:
            kept = motion, other, None, error.what
        else:
            kept = motion, other, found.distance_mm, _unknown(found.unknown)
        _apart[place] = kept
    _words[root.mu_unit.uuid] = kept[3]
    return kept[2]


def _unknown(share: float) -> str:
    return f"{share:.0%} of the surface is not in the other unit: grey" if share else ""


def _wanted(root: Any, motion: Motion, name: str, other: Motion, cut: bool) -> prepared.NotPrepared:
    """Both regions' distances, made in another process."""
    from ...studies.prepare import Prepare

    one, two = (m.folder.parent for m in (motion, other))

    def keep(arrays: Any, trouble: str) -> None:
        for region in REGIONS:
            found = None if arrays is None else arrays[region]
            words = trouble or _unknown(float(arrays[f"{region}_unknown"]))
            _apart[motion.folder, other.folder, f"{name}|{region}", cut] = motion, other, found, words

    of = {"one": str(one), "other": str(two), "name": name, "cut": cut}
    folder = studies.folder_of(root) / "difference"
    return prepared.NotPrepared(root, "difference of runs", folder, Prepare(result="difference", of=of), keep)


def embedded(root: Any, motion: Motion, points: Any) -> Embedding:
    """Points (p, 3) in mm of the unit's frame embedded in a motion's mesh; raises NotPrepared in a window."""
    if not (prepared.at_once() or motion.embedding_file(points).is_file()):
        from ...studies.prepare import Prepare

        of = {"one": str(motion.folder.parent), "points": key(points)}
        folder = studies.folder_of(root) / "embedding"
        job = Prepare(result="embedding", of=of)
        raise prepared.NotPrepared(root, "motion of the print", folder, job, lambda *_: None, points)
    return motion.embedding(points)


def difference_words(root: Any) -> str:
    """Text on the difference to another run: its size, or why there is none."""
    return _words.get(root.mu_unit.uuid, "")


def clear() -> None:
    """Empty the caches."""
    for kept in (_motions, _apart, _words):
        kept.clear()
