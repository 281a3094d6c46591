"""Kind of experiment that a table is: by its quantities and the words of its file, else asked."""

from __future__ import annotations

import re
from collections.abc import Mapping

import attrs
import numpy as np

from ..arrays import Array
from ..measured.kinds import KINDS, named
from .proposal import NoExperiment, Proposal
from .quantities import ask_column, may_hold
from .units import READ_IN, plain, unit_of

_TENSION = re.compile(r"tensil|tension test|zugversuch|\bzug\b|traction|trazione|traccion|rozciagan")
_COMPRESSION = re.compile(r"compress|druckversuch|stauch|druckspannung|\bdruck\b|schiacc|sciskan")
# Titles of amplitudes, by frequency or temperature.
_OSCILLATION = (
    r"oscillat|\bosz|schwing|amplitud|dynamic (strain|stress|force|displ)|"
    r"(storage|loss|complex) mod|speichermod|verlustmod|module de (conservation|"
    r"perte)|modulo (elastico|viscoso)|tan ?\W?(delta|d\b|\u03b4)|loss factor|verlustfaktor|"
    r"\b[eg]['\u2032\"\u2033]|\bfrequen|\bfreq\b|\bf ?[/\[(] ?hz|phase angle|phasenwinkel"
)
# What titles say against a stress-strain curve: of any column, and of one that is read as stress or strain.
_OF_ANY = (
    (_OSCILLATION, "shows a test by oscillation: its loads are amplitudes, and no stress-strain curve"),
    (r"shear rate|scherrate|schergeschw|vis[ck]osit", "shows a test in shear, not in tension or compression"),
)
_OF_READ = (
    (r"(?<!pure )shear|\bscher|\bschub|cisaill|taglio|cizall", "is of shear, not of tension or compression"),
    (
        r"\btrue\b|\bwahr|\bvrai|cauchy|hencky|logarithm",
        "is true, not nominal: by the deformed size",
    ),
)
# Columns that are asked for at most.
_MOST_ASKED = 12
# A pressure that goes this share of its range within that share of a record, read so many times a second.
_STEP, _WITHIN, _CAMERA_Hz = 0.6, 0.02, 20.0
LOADED = ("coupon", "lattice_compression")
# Quantities of each kind that is known by them alone, the more particular first, and what is concluded.
_KNOWN_BY = (
    ("unit_pose", {"pressure_kPa", "orientation_deg", "angle_deg"}, ""),
    ("blocked_force", {"pressure_kPa", "force_N"}, "a force beside a pressure (kind=... for another)"),
    ("unit_pressure", {"pressure_kPa", "angle_deg"}, ""),
    ("unit_pressure", {"pressure_kPa", "volume_mm3"}, ""),
    ("waveguide_bending", {"angle_deg", "voltage_V"}, ""),
    ("beam_deadweight", {"added_mass_g", "tip_deflection_mm"}, ""),
)


def with_kind(draft: Proposal) -> Proposal:
    """The draft with its kind, "" where it must be asked; raises InputError, NoExperiment."""
    asked = any(question.key.startswith("column.") for question in draft.questions)
    answer = draft.choice("kind", tuple(KINDS))
    if answer is not None:
        return attrs.evolve(draft, kind="" if asked else answer)
    have = set(draft.columns)
    for kind, needed, why in _KNOWN_BY:
        if needed <= have:
            if needed == {"pressure_kPa", "angle_deg"} and _is_stepped(draft.columns):
                kind = "pressure_step"
                why = (
                    "the pressure jumps, and was read often enough to see the unit follow "
                    "(kind=unit_pressure where it was slow)"
                )
            return attrs.evolve(draft.concluding(f"{kind}: {why}") if why else draft, kind=kind)
    if any(have.issuperset(load) for load in KINDS["coupon"].needs):
        return _loading(draft)
    if asked:
        return draft
    unknown = [k for k in draft.free if not draft.block.columns[k].quantity]
    for k in unknown[:_MOST_ASKED]:
        unit = unit_of(draft.block.columns[k].unit)
        fit = [q for q, read in READ_IN.items() if q != "count" and (unit is None or read == unit[0])]
        draft = ask_column(draft, k, fit)
    if unknown:
        return draft
    if "pressure_kPa" in have:
        return attrs.evolve(draft, kind="pressure_hold")
    ways = "; ".join(
        f"{kind.name}: {' or '.join(', '.join(g) for g in kind.needs)}" for kind in KINDS.values()
    )
    raise NoExperiment(
        f"no kind of experiment has {' and '.join(sorted(have)) or 'no known column'} alone; there are "
        f"{draft.titles}{_unread(draft)}",
        draft.where,
        f"export the columns of one kind ({ways}), or say with column.TITLE=QUANTITY what a column holds",
    )


def _loading(draft: Proposal) -> Proposal:
    """Kind of loading, tension of a specimen or compression of a lattice, by the file's text."""
    require_curve(attrs.evolve(draft, kind=LOADED[0]))
    block = draft.block
    words = " ".join(
        [draft.file.stem, block.sheet, block.label, *(c.title for c in block.columns)]
        + [" ".join((key, *cells)) for key, cells in block.facts.items()]
    )
    pulled, pressed = (bool(pattern.search(plain(words))) for pattern in (_TENSION, _COMPRESSION))
    if pulled != pressed:
        kind = "coupon" if pulled else "lattice_compression"
        words = f"{kind}: the file speaks of {'tension' if pulled else 'compression'}"
        return attrs.evolve(draft.concluding(words), kind=kind)
    words = "a specimen was loaded: was it a coupon of resin, or a block of lattice compressed?"
    return draft.asked("kind", words, LOADED)


def _is_stepped(columns: Mapping[str, Array]) -> bool:
    """Return True if a record is of pressure steps, sampled fast."""
    t, p = columns.get("time_s"), columns["pressure_kPa"]
    if t is None or len(t) < 50 or not np.isfinite(p).all() or not (np.diff(t) > 0).all():
        return False
    lasts, extent = float(t[-1] - t[0]), float(np.ptp(p))
    if not extent or len(t) / lasts < _CAMERA_Hz:
        return False
    later = np.interp(t + _WITHIN * lasts, t, p)
    return bool(np.abs(later - p).max() >= _STEP * extent)


def require_curve(draft: Proposal) -> Proposal:
    """Raise NoExperiment for amplitudes, shear, true stress or strain, and for one strain alone.

    A column whose quantity is answered is taken as it is.
    """
    if draft.kind not in LOADED:
        return draft
    loads = {draft.table[name].place for name in ("strain", "stress_kPa") if name in draft.table}
    for k, one in enumerate(draft.block.columns):
        against = (*_OF_ANY, *(_OF_READ if k in loads else ()))
        why = next((words for pattern, words in against if re.search(pattern, plain(one.title))), "")
        if why and draft.answer_on("column", one)[1] is None:
            raise NoExperiment(
                f"{draft.title(k)} {why}",
                draft.where,
                "export nominal stress and strain of one pull or pressing; if each row is a reading of one, "
                f"answer column.{draft.key(one)}=none, or with its quantity",
            )
    for name in ("strain", "displacement_mm"):
        read = draft.table.get(name)
        if read is None or read.place is None or "time_s" in draft.table:
            continue
        one = draft.block.columns[read.place]
        readings = set(read.values[np.isfinite(read.values)])
        if len(readings) == 1 and draft.answer_on("column", one)[1] is None:
            raise NoExperiment(
                f"{name} is {readings.pop():g} in every row, and there is no time: that is no curve",
                draft.where,
                f"export a test of one pull or pressing, or the time of a test that holds the {name}",
            )
    return draft


def with_needed(draft: Proposal) -> Proposal:
    """Ask for the columns that the kind needs; raises NoExperiment if no candidate is left."""
    have, kind = set(draft.columns), KINDS[draft.kind]
    groups = [set(group) | ({"time_s"} if kind.timed else set()) for group in kind.needs]
    if any(group - {"time_s"} <= have for group in groups):
        return draft
    # The group that most columns are there for, or may be by their units.
    ways = []
    for group in groups:
        gone = sorted(group - have - {"time_s"})
        wanted = [q for q in READ_IN if named(q) in gone]
        unknown = [k for k in draft.free if may_hold(draft, k, wanted)]
        fit = [q for q in wanted if any(may_hold(draft, k, [q]) for k in unknown)]
        ways.append((len(group & have) / len(group), len(fit) / len(gone), gone, wanted, unknown))
    _, _, gone, wanted, unknown = max(ways, key=lambda way: way[0] + way[1])
    if not unknown:
        raise NoExperiment(
            f"{kind.name} needs {' and '.join(gone)}, and no column is left that may hold it; there are "
            f"{draft.titles}{_unread(draft)}",
            draft.where,
            "export that column as well, choose another kind, or say with column.TITLE=QUANTITY and "
            "unit.TITLE=UNIT what a column holds",
        )
    alone = len(draft.free) == len(wanted) == 1
    for k in unknown[:_MOST_ASKED]:
        draft = ask_column(draft, k, wanted, f", as {kind.name} needs {' and '.join(gone)}", alone)
    return draft


def _unread(draft: Proposal) -> str:
    """Columns that were not read, with the reasons, for an error."""
    listed = "; ".join(one.words for one in draft.unread if one.what)
    return f"; not read: {listed}" if listed else ""
