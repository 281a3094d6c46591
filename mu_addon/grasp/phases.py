"""The protocol of a grasp: pressure over time, and the phase of each time."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..design.assets import asset_root
from ..errors import InputError
from ..fem.protocol import COLUMNS, Protocol, read_protocol, read_protocol_text

SHIPPED = "protocols/gripper.csv"
NAMES = ("i", "ii", "iii", "iv", "v")
WORDS = {"i": "opening", "ii": "closing", "iii": "holding", "iv": "lifting", "v": "releasing"}
"""Action of the hand in a phase."""
MEANING = {
    "i": "open by vacuum; the cube is placed between the tips",
    "ii": "close",
    "iii": "hold; the cube rests on its support",
    "iv": "lift; the support is removed",
    "v": "release; the cube is on a support again",
}


@attrs.frozen(eq=False)
class Phases:
    """Corner points (c,) of a protocol and the phase (c,) that ends at each."""

    protocol: Protocol
    phase: tuple[str, ...]

    def span(self, name: str) -> tuple[float, float]:
        """Start and end of a phase in s."""
        own = [i for i, phase in enumerate(self.phase) if i and phase == name]
        time = self.protocol.time_s
        return float(time[own[0] - 1]), float(time[own[-1]])

    def sample(self, step_s: float) -> tuple[Array, Array, tuple[str, ...]]:
        """Instants (k,) in s at every corner and at most `step_s` apart, their pressure in kPa and phase."""
        corners = self.protocol.time_s
        parts = [
            np.linspace(a, b, max(1, int(np.ceil((b - a) / step_s - 1e-9))) + 1)[1:]
            for a, b in pairwise(corners)
        ]
        time = np.concatenate([corners[:1], *parts])
        pressure = np.round(np.interp(time, corners, self.protocol.pressure_kPa), 9)
        at = np.minimum(np.searchsorted(corners, time - 1e-9), len(corners) - 1)
        return time, pressure, tuple(self.phase[max(1, int(i))] for i in at)

    def text(self) -> str:
        """The protocol as CSV, to its last digit."""
        p = self.protocol
        rows = zip(p.time_s, p.pressure_kPa, self.phase, strict=True)
        lines = [f"{float(t)!r},{float(v)!r},{name}" for t, v, name in rows]
        return "\n".join(["time_s,pressure_kPa,phase", *lines]) + "\n"


def read_phases(path: Path) -> Phases:
    """Read a grasp's protocol: columns time_s, pressure_kPa and phase, i to v in this order, each once.

    Raises InputError as `read_protocol` does, and for phases that are missing, out of order or unknown.
    """
    protocol = read_protocol(path)
    text = read_protocol_text(path, COLUMNS)
    if "phase" not in text.names:
        raise InputError("the protocol lacks the column phase", str(path), f"name phases {', '.join(NAMES)}")
    column = text.names.index("phase")
    phase = tuple(cells[column] if column < len(cells) else "" for _, _, cells in text.rows)
    met = tuple(dict.fromkeys(phase[1:]))
    changes = sum(a != b for a, b in pairwise(phase[1:]))
    if met != NAMES or changes != len(NAMES) - 1:
        raise InputError(
            f"the phases are {', '.join(met) or 'not named'}",
            str(path),
            f"name {', '.join(NAMES)}, each once, in this order",
        )
    return Phases(protocol, phase)


def shipped_phases() -> Phases:
    """The protocol that comes with the package."""
    return read_phases(asset_root() / SHIPPED)
