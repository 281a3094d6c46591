"""Candidate paths: what the ranking (Algorithm 1 of the paper) chooses from."""

from __future__ import annotations

from typing import Any

import attrs

from ..arrays import Array


@attrs.frozen(eq=False)
class Candidate:
    """A path of the waveguide: a name and `points` (h, 3) in mm.

    start: number of its first anchor, counted from 1; 0 for a path through other nodes.
    """

    name: str
    start: int
    points: Array

    @property
    def length(self) -> int:
        """Number of anchors."""
        return len(self.points)


def candidate_paths(anchors: Array, windows: Any) -> list[Candidate]:
    """Candidates of windows (name, start, length) over anchors (n, 3) in mm.

    >>> from mu_addon.design import anchor_points, load_preset, windows
    >>> paths = candidate_paths(anchor_points(load_preset("mu-1.0x")), windows(6))
    >>> paths[0].name, paths[0].points.shape
    ('alpha1', (3, 3))
    """
    return [Candidate(w.name, w.start, anchors[w.start - 1 : w.start - 1 + w.length]) for w in windows]
