"""Candidate paths by the study's results: J and rank of each, and the colour and label of its tube."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..preview import materials
from ..results import field_colours
from ..shared.compat import set_modifier_input
from ..shared.wording import path_symbol
from ..simulate import study_folder as studies


@attrs.frozen
class Known:
    """Candidate paths of the shown run: J_hat in mm by name, the best first.

    stale: True if it is of a unit with other parameters; tied: paths that differ from the best by less than
    the error of the mesh, and the best with them; at_least: lower bound of J_hat in mm of paths that were not
    solved further, since they cannot be the best; estimated: J_hat in mm by name before any path is solved.
    """

    j: dict[str, float]
    stale: bool = False
    tied: frozenset[str] = frozenset()
    at_least: dict[str, float] = attrs.field(factory=dict)
    estimated: dict[str, float] = attrs.field(factory=dict)

    @property
    def numbers(self) -> dict[str, float]:
        """J_hat in mm by name, or else its estimate: what colours show."""
        return self.j or self.estimated

    def rank(self, name: str) -> str:
        """Rank of a path as text: "#2"; "≈#1" if undecided among the best; "#2?" if stale.

        Empty where a lower bound leaves it open.
        """
        doubt = "?" if self.stale else ""
        if name in self.tied:
            return f"≈#1{doubt}"
        if name not in self.j or self.j[name] > min(self.at_least.values(), default=np.inf):
            return ""
        return f"#{list(self.j).index(name) + 1}{doubt}"

    def mean(self, name: str) -> str:
        """J_hat of a path in mm as text, or its lower bound; empty without either."""
        if name in self.j:
            return f"{self.j[name]:.3f}"
        if name in self.at_least:
            return f"≥ {self.at_least[name]:.3f}"
        return f"~ {self.estimated[name]:.2f}" if name in self.estimated else ""

    def share_of(self, j: float) -> float:
        """Position of a J in mm between the smallest, 0, and the largest, 1, shown by its colour.

        Its root, which separates the best paths most.
        """
        low, high = min(self.numbers.values()), max(self.numbers.values())
        return float(np.sqrt(max(j - low, 0.0) / (high - low))) if high > low else 0.0


def known(root: Any) -> Known:
    """J of every path in the shown run, also if that is stale; empty without a ranking."""
    found = studies.findings(root)
    if found is None:
        return Known({})
    tied = found.summary.get("tied_with_chosen") or ()
    return Known(
        dict(found.ranking),
        found.stale,
        frozenset([found.ranking[0][0], *tied] if tied else ()),
        found.run.at_least_mm,
        found.run.estimated_mm,
    )


def free(root: Any) -> tuple[str, float, Any] | None:
    """Name, J_hat in mm and points (h, 3) in mm of the whole lattice's best path; None if unknown."""
    found = studies.findings(root)
    best = None if found is None or found.stale else (found.summary.get("search") or {}).get("best")
    return (best["name"], best["J_hat_mm"], np.array(best["points_mm"])) if best else None


def colour_and_label(root: Any, candidates: dict[str, Any]) -> None:
    """Colour and label candidate tubes, objects by path.

    Stale ones are grey, their rank with a question mark; so are those of which only a bound is known.
    """
    found = known(root)
    for name in (*found.numbers, *found.at_least):
        if name not in candidates:
            continue
        tube = candidates[name]
        modifier = tube.modifiers[0]
        # Below the name: the tubes are too close for more beside it.
        below = found.rank(name) or found.mean(name)
        set_modifier_input(modifier, "Label", f"{path_symbol(name)}\n{below}")
        if name in found.numbers and not found.stale:
            _colour(root, found, name, tube, found.numbers[name])
        write_colour(tube)


def colour_free(root: Any, tube: Any, name: str, j: float) -> None:
    """Colour the whole lattice's best path, of J in mm, as the candidates."""
    found = known(root)
    if found.j:
        _colour(root, found, name, tube, j)
    write_colour(tube)


def _colour(root: Any, found: Known, name: str, tube: Any, j: float) -> None:
    colour = materials.coloured(
        f"MU J {root.mu_unit.uuid[:8]} {name}", field_colours.of_map(found.share_of(j))
    )
    tube.data.materials[0] = colour
    set_modifier_input(tube.modifiers[0], "Material", colour)


def write_colour(tube: Any) -> None:
    """Give a tube's points the colour of its material, which solid shading shows by attribute."""
    mesh = tube.data
    colour = np.float32(mesh.materials[0].diffuse_color)
    field_colours.set_colours(mesh, np.broadcast_to(colour, (len(mesh.vertices), 4)))
