"""The data that a report shows, independent of how they were computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..sensing.light_law import Law
    from ..sensing.light_signal import Response
    from ..sensing.optics import Optics

Floats = NDArray[np.floating[Any]]


@attrs.frozen
class Path:
    """A candidate path: `length` consecutive anchors from P`start`, counted from 1 from the inlet on."""

    name: str
    start: int
    length: int

    @property
    def anchors(self) -> str:
        """Its first and last anchor as text, such as "P2 to P5"."""
        return f"P{self.start} to P{self.start + self.length - 1}"


@attrs.frozen(eq=False)
class RankingResult:
    """Result of a placement; solved paths in the order of the candidates."""

    delta: Floats  # (paths, k times, j stations) mm
    j_hat: Floats  # (paths,) mm
    j_cont: Floats  # (paths,) mm
    rank: Sequence[int]  # 1 is best, among those solved
    chosen: str  # name of the best path
    tied: Sequence[str] = ()  # paths tied with the chosen one within the mesh uncertainty
    uncertainty_mm: float | None = None  # mesh uncertainty of J_hat
    at_least_mm: Mapping[str, float] = attrs.field(factory=dict)  # of paths not solved, that cannot be best


@attrs.frozen(eq=False)
class LatticePath:
    """A solved path through the lattice: points (h, 3) and length in mm, predicted and solved J_hat in mm."""

    name: str
    points: Floats
    length_mm: float
    predicted_mm: float
    j_hat: float
    on_front: bool  # no solved path is both longer and less disturbing


STRETCH_COLUMNS = (
    "pressure_kPa",
    "part",
    "largest_stretch",
    "x_mm",
    "y_mm",
    "z_mm",
    "exceeded_by_1_percent_of_volume",
    "of_elongation_percent",
)
"""Columns of stretch.csv: the largest principal stretch of each part, its position at rest, and the share of
the resin's elongation at break that 1 % of the part's volume exceeds."""


def nearest_to_break(rows: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Pressure, part, place and share in per cent of the elongation at break, of the largest share in rows of
    STRETCH_COLUMNS; empty without any."""
    shares = [(float(row[-1]), row) for row in rows if row[-1]]
    if not shares:
        return {}
    share, row = max(shares, key=lambda one: one[0])
    place = [float(x) for x in row[3:6]]
    return {"pressure_kPa": float(row[0]), "part": row[1], "place_mm": place, "percent": share}


SELF_CONTACT_COLUMNS = (
    "pressure_kPa",
    "force_N",
    "least_gap_mm",
    "largest_contact_pressure_kPa",
    "x_mm",
    "y_mm",
    "z_mm",
)
"""Columns of self_contact.csv: contact force with itself, least gap, and the peak's position at rest."""


CONTACT_COLUMNS = (
    "time_s",
    "pressure_kPa",
    "obstacle",
    "normal_N",
    "friction_N",
    "force_x_N",
    "force_y_N",
    "force_z_N",
    "area_mm2",
    "sticking",
    "gap_error_mm",
    "slid_mm",
    "lost_mJ",
)


@attrs.frozen(eq=False)
class ContactHistory:
    """Contact of a whole unit with b rigid bodies at k instants: forces (b, k, 3) of the unit on them, in N.

    area_mm2, sticking, deepest_mm, slid_mm and lost_mJ (b, k): see `fem.obstacle.Contact`; slid_mm is the
    largest distance in mm that a point has slid so far. friction (b,): coefficients; time_s in s and
    pressure_kPa in kPa (k,).
    """

    names: tuple[str, ...]
    friction: tuple[float, ...]
    time_s: Floats
    pressure_kPa: Floats
    normal_N: Floats
    tangential_N: Floats
    area_mm2: Floats
    sticking: Floats
    deepest_mm: Floats
    slid_mm: Floats
    lost_mJ: Floats

    @property
    def force_N(self) -> Floats:
        """Size (b, k) in N of the sum of normal and friction force."""
        return np.asarray(np.linalg.norm(self.normal_N + self.tangential_N, axis=2))

    def rows(self) -> list[tuple[Any, ...]]:
        """Rows of contact.csv, one for each instant and body, with columns CONTACT_COLUMNS; all text."""
        found = []
        for k, (time, pressure) in enumerate(zip(self.time_s, self.pressure_kPa, strict=True)):
            for b, name in enumerate(self.names):
                normal, rubbing = self.normal_N[b, k], self.tangential_N[b, k]
                values = [np.linalg.norm(normal), np.linalg.norm(rubbing), *(normal + rubbing)]
                values += [self.area_mm2[b, k], self.sticking[b, k], self.deepest_mm[b, k]]
                values += [self.slid_mm[b, k], self.lost_mJ[b, k]]
                found.append((f"{time:.9g}", f"{pressure:.9g}", name, *(f"{v + 0.0:.6g}" for v in values)))
        return found

    def summary(self) -> dict[str, Any]:
        """Figures by number and name of the body: largest force in N and its instant, gap error, sliding."""
        found = {}
        for b, name in enumerate(self.names):
            k = int(self.force_N[b].argmax())
            found[f"{b + 1} {name}"] = {
                "friction": self.friction[b],
                "largest_force_N": float(self.force_N[b, k]),
                "at_s": float(self.time_s[k]),
                "at_kPa": float(self.pressure_kPa[k]),
                "largest_gap_error_mm": float(self.deepest_mm[b].max()),
                "slid_mm": float(self.slid_mm[b].max()),
                "lost_mJ": float(self.lost_mJ[b].max()),
            }
        return found


@attrs.frozen(eq=False)
class Checks:
    """Rays through a bent waveguide: angles (k,) in degrees, delta V / V_f (k,) and its error (k,)."""

    angle_deg: Floats
    delta: Floats
    errors: Floats


@attrs.frozen(eq=False)
class Signals:
    """Predicted optical signal of each path, arrays (paths,) in the order of the study's windows.

    errors_per_deg: error of a response's slope, per degree, from the law's own; at_rest: share of the light
    that arrives at rest; j_hat: mean deviations in mm, or lower bounds of them where not solved; checks: of
    the law, by rays, for the path with the least deviation; front: True for a path that is Pareto-optimal in
    deviation and signal, None where a bound leaves that open. sets: pairs, then triples, of paths that
    together resolve the distribution of bending along the unit best, with the logarithm of their information,
    best first; differential: pairs read against each other, with the slope of their difference per degree,
    best first.
    """

    optics: Optics
    law: Law
    names: tuple[str, ...]
    responses: tuple[Response, ...]
    errors_per_deg: Floats
    at_rest: Floats
    checks: Checks
    j_hat: Floats
    front: tuple[bool | None, ...]
    sets: tuple[tuple[tuple[str, ...], float], ...]
    differential: tuple[tuple[tuple[str, ...], float], ...]
    solved: tuple[bool, ...]


@attrs.frozen(eq=False)
class Picture:
    """An image as PNG bytes, with a caption and an alternative text."""

    png: bytes
    caption: str
    alt: str


@attrs.frozen(eq=False)
class SideView:
    """The unit seen along -x: image (h, w, 4), extent (y, y, z, z) in mm, anchors (n, 2) as y and z in mm."""

    image: NDArray[np.uint8]
    extent: tuple[float, float, float, float]
    anchors: Floats  # (n, 2) y and z
