"""The data that a report shows, independent of how they were computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..sensing.law import Law
    from ..sensing.optics import Optics
    from ..sensing.signal import Response

Floats = NDArray[np.floating[Any]]


@attrs.frozen
class Parameter:
    """One row of the parameter table; `source` says where the value is from, or why it was assumed."""

    path: str
    value: Any
    unit: str = ""
    source: str = ""
    assumed: bool = False


@attrs.frozen
class Gate:
    """A check with a number: what was found, what was asked for, and whether it passed."""

    name: str
    value: Any
    limit: str
    passed: bool


@attrs.frozen
class Path:
    """A candidate sensor path: `length` contiguous anchors from P`start` (counted from 1, from the inlet)."""

    name: str
    start: int
    length: int

    @property
    def anchors(self) -> str:
        """Its first and last anchor as text."""
        return f"P{self.start} to P{self.start + self.length - 1}"


@attrs.frozen(eq=False)
class RuleResult:
    """What one inclusion rule found, per path in the order of `ReportData.paths`."""

    delta: Floats  # (paths, k times, j stations) mm
    j_hat: Floats  # (paths,) mm
    j_cont: Floats  # (paths,) mm
    rank: Sequence[int]  # 1 is best
    stiffened_mm3: Floats  # volume that got E_sens
    cylinder_mm3: Floats  # volume of the sensor itself
    chosen: str  # name of the best path
    tied: Sequence[str] = ()  # paths that the mesh cannot tell from the chosen one
    uncertainty_mm: float | None = None  # how far the mesh may move a J_hat


@attrs.frozen(eq=False)
class LatticePath:
    """A path of the lattice that was solved exactly: points (h, 3) and length in mm, J_hat in mm."""

    name: str
    points: Floats
    length_mm: float
    predicted_mm: float
    j_hat: float
    on_front: bool  # no solved path is both longer and less disturbing


@attrs.frozen(eq=False)
class LatticeSearch:
    """The search of the whole lattice: solved paths, best first, out of so many, and the risk left."""

    rule: str
    solved: Sequence[LatticePath]
    paths: int
    risk: float  # probability, at most, that an unsolved path is better


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
    """A whole unit's contact with b rigid bodies at k instants; forces (b, k, 3) are its on them, in N.

    area_mm2, sticking, deepest_mm, slid_mm and lost_mJ (b, k): see `fem.obstacle.ObstacleContact`; slid_mm is
    the farthest that a point has slid so far.
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
        """Size (b, k) of the whole force."""
        return np.asarray(np.linalg.norm(self.normal_N + self.tangential_N, axis=2))

    def rows(self) -> list[tuple[Any, ...]]:
        """A row of contact.csv an instant and body, see `CONTACT_COLUMNS`."""
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
        """Its figures by name of the body; two of a name are told apart by their number."""
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
    """Rays through a bent waveguide: angle_deg, Delta V / V_f and its error by their number, (k,) each."""

    angle_deg: Floats
    delta: Floats
    errors: Floats


@attrs.frozen(eq=False)
class Signals:
    """What light would tell along each path, in the order of the study's windows.

    errors_per_deg: what the law's own error makes of a response's slope; at_rest: share of the light that
    arrives at rest; checks: of the law for the least disturbing path, by rays; front: whether no path
    disturbs less and tells more;
    sets: pairs, then triples, of paths that tell most of how bending is spread along the unit, best first.
    differential: pairs read one against the other, with the slope of their difference a degree, best first.
    """

    optics: Optics
    law: Law
    names: tuple[str, ...]
    responses: tuple[Response, ...]
    errors_per_deg: Floats
    at_rest: Floats
    checks: Checks
    j_hat: Floats
    front: tuple[bool, ...]
    sets: tuple[tuple[tuple[str, ...], float], ...]
    differential: tuple[tuple[tuple[str, ...], float], ...]


@attrs.frozen(eq=False)
class Picture:
    """An image with the words that go with it."""

    png: bytes
    caption: str
    alt: str


@attrs.frozen(eq=False)
class SideView:
    """The unit seen along -x: `image` (h, w, 4), the y and z of its edges (`extent`) and anchors in mm."""

    image: NDArray[np.uint8]
    extent: tuple[float, float, float, float]
    anchors: Floats  # (n, 2) y and z


@attrs.frozen(eq=False)
class ReportData:
    """One run, as far as it came: what was not reached stays empty and is left out of the report."""

    title: str
    unit: str
    status: str = "complete"  # or "partial"
    reason: str = ""  # why it is partial
    warnings: Sequence[str] = ()
    view: SideView | None = None
    pictures: Sequence[Picture] = ()
    paths: Sequence[Path] = ()
    rules: Mapping[str, RuleResult] = attrs.field(factory=dict)  # "volume_fraction", "intersect"
    headline_rule: str = "volume_fraction"  # whose chosen path is the answer
    search: LatticeSearch | None = None
    search_picture: Picture | None = None
    light: Signals | None = None
    contact: ContactHistory | None = None
    effects: Sequence[str] = ()  # that measured data named and the simulation has, in words
    pressure_kPa: Floats = attrs.field(factory=lambda: np.zeros(0))  # per converged state
    angle_deg: Floats = attrs.field(factory=lambda: np.zeros(0))
    protocol_s: Floats = attrs.field(factory=lambda: np.zeros(0))
    protocol_kPa: Floats = attrs.field(factory=lambda: np.zeros(0))
    parameters: Sequence[Parameter] = ()
    mesh: Mapping[str, Any] = attrs.field(factory=dict)  # label with unit -> figure
    solver: Mapping[str, Any] = attrs.field(factory=dict)
    gates: Sequence[Gate] = ()
    seconds: Mapping[str, float] = attrs.field(factory=dict)
    versions: Mapping[str, str] = attrs.field(factory=dict)
    files: Mapping[str, str] = attrs.field(factory=dict)  # name in the run's folder -> what it holds
