"""A diagnosis as text: its verdict in a sentence, parameters with intervals, the next measurement."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..evidence.acceptance import BOUND
from ..evidence.effect import BATCH, FORCE_SCALE, OF, SLIP, STEP, THICKNESS, Effect, bare, readable
from ..evidence.effects import DECLARED
from ..evidence.effects.marker_slip import Recordings
from ..evidence.found_causes import Cause
from ..evidence.pooled import sizes_of
from ..evidence.prediction.unit_pressure import MODULUS
from ..evidence.record import KNOWN
from ..evidence.scatter import STATED, noise_limit
from ..evidence.sensitivity import best_seen
from ..evidence.simulator import bends
from ..evidence.verdict import Verdict
from ..measured import Experiment
from ..run.parts import listed

# Of the table of dependences: the size of what is left against the data's own spread.
SPREAD = "spread"
# Names of experiments and specimens with a rigid chamber, and the request that replaces one for it.
_RIGID = re.compile(r"rigid|control|blank|alumin|metal|steel|plug", re.IGNORECASE)
_INSTEAD = {
    "the same hold with a plug of metal in the unit's place": "the same hold with soapy water on its joints",
    "a longer hold, and the same in a rigid chamber of that volume": "a hold ten times as long",
}
_LATER = re.compile(r"^of tests from (.*) on$")
_ALONE = re.compile(r": (\d+) of (\d+) readings stand alone")
# Most names of a set in its headline.
MOST_NAMES = 4
# Units mistaken for others, by what they scale: the first is so many of the second's numbers.
_FORCES = {("lbf", "N"): 0.224809, ("kgf", "N"): 0.101972}
_PRESSURES = {
    ("psi", "kPa"): 0.145038,
    ("mmHg", "kPa"): 7.50062,
    ("inHg", "kPa"): 0.2953,
    ("mH2O", "kPa"): 0.101972,
}
SLIPS = {
    FORCE_SCALE: _FORCES,
    BATCH: _FORCES,
    STEP: _FORCES,
    "pressure_gain": _PRESSURES,
}
SLIP_SHARE = 0.03
# Elastomers are tested up to so many degrees; a room has 60 to 80 °F.
WARMEST_C = 60.0
# Least share of a misfit for an explanation to be reported.
LEAST_SHARE = 0.1
# Number of intervals from which a table is used.
TABLE = 6
# Of a factor of moduli: less is not worth a word.
NEAR_ONE = 0.02
ASK_STRUTS = "If specimens were drawn with struts other than the unit's, give the strut_mm of each."
# Most detection limits in the sentence of a verdict `none`.
MOST_LIMITS = 5
# Most proposed measurements for effects that the data cannot show.
MOST_SHOWN = 3


def subtitle(experiments: Sequence[Experiment], self_contact: bool) -> str:
    """The experiments, and how the unit that they bend was modelled."""
    held, count = sum(e.role == "held_out" for e in experiments), len(experiments)
    kinds = listed([readable(k) for k in dict.fromkeys(e.kind for e in experiments)])
    words = f"{count} experiment{'s' if count > 1 else ''} ({kinds}), {held or 'none'} of them held out"
    walls = f"walls {'kept apart' if self_contact else 'may cross'}"
    return f"{words}; the unit as printed, {walls}" if bends(experiments) else words


def called(effect: Effect) -> str:
    """An effect's title for a reader; a scale of force with its possible causes."""
    return " ".join(_parts(effect))


def _parts(title: Effect | str) -> list[str]:
    """Name of an effect, or of a rival by its title, and its owner if it has one, for a reader."""
    effect, title = (title, title.title) if isinstance(title, Effect) else (None, title)
    name, *owner = title.split(" ", 1)
    if effect is not None and effect.name == FORCE_SCALE:
        name += f" ({effect.mechanism.partition(': ')[2]})"
    return [readable(name), *(_LATER.sub(r"of tests from “\1” on", words) for words in owner)]


def alternatives(effects: Sequence[Effect | str]) -> str:
    """Alternative causes, those of one owner together: "a or b of specimen B; or c"."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for effect in effects:
        name, *owner = _parts(effect)
        groups.setdefault(tuple(owner), []).append(name)
    choices = [" ".join([listed(names, "or"), *owner]) for owner, names in groups.items()]
    if len(choices) in (1, len(effects)):
        return listed(choices, "or")
    return f"{'; '.join(choices[:-1])}; or {choices[-1]}"


def between(low: float, high: float) -> str:
    """An interval in as few digits as distinguish its ends, three at least."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "not known"
    for digits in range(3, 7):
        ends = f"{low:.{digits}g}", f"{high:.{digits}g}"
        if ends[0] != ends[1]:
            break
    return f"{ends[0]} to {ends[1]}"


def sized(verdict: Verdict, cause: Cause) -> str:
    """Parameters of a cause with their intervals, as text."""
    if cause.effect.name == SLIP:
        return _slipped(verdict, cause)
    sizes = []
    if cause.effect.among:
        return _differing(verdict, cause.effect)
    for key, p in zip(cause.effect.keys, cause.effect.parameters, strict=True):
        low, high = verdict.intervals.get(key, (math.nan, math.nan))
        unit = f" {p.unit}" if p.unit else ""
        value = verdict.selection.chosen.values[key]
        sizes.append(f"{bare(p)} {value:.3g}{unit} (95 %: {between(low, high)})")
        if (cause.effect.name, p.name) == ("overcure", "offset_mm"):
            sizes.append(f"of every surface, so that struts and walls are {2 * value:.2g} mm thicker")
    return ", ".join(sizes)


def _differing(verdict: Verdict, effect: Effect) -> str:
    """Smallest and largest size among the owners of an effect, and the spread of all."""
    values = verdict.selection.chosen.values
    unit = effect.parameters[0].unit
    sizes = sorted((values[key], p.name) for key, p in sizes_of(effect))
    name = bare(effect.parameters[0]).partition(OF)[0]
    ends = [
        f"{value:.3g} {unit}".rstrip() + f" ({key.partition(OF)[2]})" for value, key in (sizes[0], sizes[-1])
    ]
    sd, low, high = effect.spread
    spread = f"{sd:.3g} {unit}".rstrip()
    # So many intervals are a table.
    return f"{name} from {ends[0]} to {ends[1]}, standard deviation {spread} (95 %: {between(low, high)})"


def _slipped(verdict: Verdict, cause: Cause) -> str:
    """Size, direction in the picture, and time of a marker's slip, by its record's clock."""
    values = verdict.selection.chosen.values
    *sizes, moment = zip(cause.effect.keys, cause.effect.parameters, strict=True)
    words: list[str] = []
    for key, p in sizes:
        low, high = verdict.intervals.get(key, (math.nan, math.nan))
        way = f"along {axis}" if (axis := p.name.split("_")[1]) in ("y", "z") else "by"
        if p.unit == "deg":
            way = "in the picture of the unit at rest, from y (across) toward z (along the axis), by"
        words.append(f"{way} {values[key]:.3g} {p.unit} (95 %: {between(low, high)})")
    key, _ = moment
    record, second = Recordings(verdict.experiments).place(values[key])
    clock = record["time_s"]
    if second <= clock[0]:
        return f"{', '.join(words)}, before {record.name}"
    # Its moment between two samples is unknown.
    half = 0.5 * float(np.median(np.diff(clock)))
    low, high = verdict.intervals.get(key, (math.nan, math.nan))
    ends = between(second - values[key] + low - half, second - values[key] + high + half)
    return f"{', '.join(words)}, in {record.name} at {second:.4g} s (95 %: {ends})"


def in_a_table(verdict: Verdict) -> bool:
    """Return True if the values of the causes, with their intervals, are too many for a sentence."""
    return sum(1 if c.effect.among else len(c.effect.keys) for c in verdict.selection.causes) >= TABLE


def sentence(verdict: Verdict) -> tuple[str, str]:
    """The verdict as text: its headline, and one sentence, without values if they are `in_a_table`."""
    found, tabled = verdict.selection, in_a_table(verdict)
    if verdict.kind == "named":
        sizes = [
            f"{_upper(c.effect.mechanism)}{_of_one_only(c)}{'' if tabled else f'; {sized(verdict, c)}'}."
            for c in found.causes
        ]
        names = listed([called(c.effect) for c in found.causes])
        sizes += [more for more in (_struts(verdict), _unit_slip(verdict), _left_out(verdict)) if more]
        if not found.left:
            return names, " ".join(sizes)
        return f"mainly {names}", " ".join([*sizes, _what_remains(verdict)])
    if verdict.kind == "ambiguous":
        choices = [alternatives([c.effect, *c.rivals]) for c in found.causes]
        sizes = [f"{readable(c.effect.title)}: {sized(verdict, c)}" for c in found.causes]
        message = "Each of these effects explains the data, and these data do not distinguish them." + (
            "" if tabled else f" Fitted values: {'; '.join(sizes)}."
        )
        head = " and ".join(choices)
        struts, more = _struts(verdict), [_unit_slip(verdict), _left_out(verdict)]
        if sum(1 + len(c.rivals) for c in found.causes) > MOST_NAMES:
            # Numbers first: what all these names have in common.
            first = max(found.causes, key=lambda c: len(c.rivals))
            one = f"{called(first.effect)} or one of {len(first.rivals)} effects that act alike"
            message = f"It may be {head}. {message}"
            head = struts.rstrip(".") if struts and struts != ASK_STRUTS else one
        message = " ".join(w for w in (struts, message, *more) if w)
        if not found.left:
            return head, message
        message = message.replace("explains the data", "explains nearly all of the data")
        return f"mainly {head}" if head != struts.rstrip(".") else head, f"{message} {_what_remains(verdict)}"
    if verdict.kind == "none":
        return (
            "no model error detected",
            f"The error, {_error(verdict)}, is no larger than the noise that {_shown(verdict)}. "
            f"{left_out + ' ' if (left_out := _left_out(verdict)) else ''}{_zeros(verdict)}"
            f"{_limits(verdict)}",
        )
    if verdict.kind == "unidentifiable":
        return (
            "not identifiable",
            f"The model fits the data only with {_far(verdict)}. More data of this kind cannot identify the "
            "cause.",
        )
    where = [readable(n) for n in found.left if n != SPREAD]
    tried = (
        "The residual exceeds the standard deviation given with the data. " if SPREAD in found.left else ""
    )
    tried += f"The residual depends on {listed(where)}. " if where else ""
    if found.doubted:
        tried += f"{_upper(readable(found.doubted))}. "
    at_bound = found.doubted.partition(", which")[0] if BOUND in found.doubted else ""
    return (
        f"unexplained by any known effect{f'; {readable(at_bound)}' if at_bound else ''}",
        f"The model misses these data by {_error(verdict)}, and no effect of the library explains that. "
        f"{tried}{_near(verdict)} {_left_out(verdict)}".strip(),
    )


def _left_out(verdict: Verdict) -> str:
    """Number of readings that stand alone and do not count, as a sentence; empty without any."""
    found = [m for words in verdict.set_aside if (m := _ALONE.search(words))]
    count, every = (sum(int(m[k]) for m in found) for k in (1, 2))
    return (
        f"{count} of {every} readings of {len(found)} records stand alone and do not count." if count else ""
    )


def warm(experiments: Iterable[Experiment]) -> list[str]:
    """Temperatures at which such parts are seldom tested, as text, with those if they were in deg F."""
    return [
        f"{e.name}: temperature_C is {e.temperature_C:g}; {e.temperature_C:g} °F would be "
        f"{(e.temperature_C - 32.0) / 1.8:.3g} °C: check the unit"
        for e in experiments
        if e.temperature_C > WARMEST_C
    ]


def _unit_slip(verdict: Verdict) -> str:
    """Unit in which some readings would be as others are, by a fitted factor on them; empty without any."""
    for c in verdict.selection.causes:
        key = c.effect.keys[0]
        if c.effect.among or not c.effect.whose or c.effect.name not in SLIPS:
            continue
        factor, (low, high) = 1.0 + verdict.selection.chosen.values[key], verdict.intervals[key]
        for (unit, other), known in SLIPS[c.effect.name].items():
            for written, under, times in ((unit, other, known), (other, unit, 1.0 / known)):
                near = abs(factor / times - 1.0) < SLIP_SHARE or low < times - 1.0 < high
                if near and high - low < SLIP_SHARE * 10.0 * factor:
                    return (
                        f"Readings {factor:.3g} times as large, which is the factor of {written} and "
                        f"{under}: check the unit of {c.effect.whose}."
                    )
    return ""


def _limits(verdict: Verdict) -> str:
    """Smallest detectable sizes of the least visible effects, and the hidden effects, as text."""
    visible, hidden = [], []
    for s in best_seen(verdict.seen).values():
        p = s.effect.parameters[0]
        if s.identifiable and s.linear:
            size = f"{readable(s.effect.name)} ({bare(p)} {s.limit:.2g} {p.unit}".rstrip() + ")"
            visible.append((s.limit / max(abs(p.high - p.null), abs(p.low - p.null)), size))
        elif not s.identifiable:
            hidden.append(readable(s.effect.name))
    unseen = f" Hidden at any size: {listed(sorted(hidden))}." if hidden else ""
    if not visible:
        return f"Nothing would have been detected.{unseen}"
    least = [size for _, size in sorted(visible, reverse=True)[:MOST_LIMITS]]
    more = len(visible) - len(least)
    others = f"; the limits of {more} more are in “Identifiability of each effect”" if more else ""
    return f"What would have been detected, the least visible first: {'; '.join(least)}{others}.{unseen}"


def _struts(verdict: Verdict) -> str:
    """Thickness that the struts of specimens drawn unlike act with, if it is a cause or a rival; else empty.

    One modulus is fitted to all, so that the differences alone are in the data.
    """
    drawn = {e.specimen: e.strut_mm for e in verdict.experiments if e.specimen and e.strut_mm}
    found = verdict.selection
    titles = {t for c in found.causes for t in (c.effect.title, *c.rivals)}
    for fit in (found.chosen, *found.wider):
        for effect in fit.effects:
            if effect.name == THICKNESS and effect.among and effect.title in titles:
                acting: dict[float, list[float]] = {}
                for key, p in sizes_of(effect):
                    if mm := drawn.get(p.name.partition(OF)[2].removeprefix(f"{effect.among} ")):
                        acting.setdefault(mm, []).append(mm + fit.values[key])
                unsaid = not drawn and any(e.cells for e in verdict.experiments)
                return ASK_STRUTS if unsaid else _acting(acting)
    return ""


def _acting(acting: Mapping[float, Sequence[float]]) -> str:
    """Effective diameters of struts in mm, by the drawn ones; empty if all were drawn equal."""
    if len(acting) < 2:
        return ""
    thick, *others = sorted(acting, reverse=True)
    words: list[str] = []
    for mm in (thick, *others):
        ends = between(min(acting[mm]), max(acting[mm])) if len(acting[mm]) > 1 else f"{acting[mm][0]:.3g}"
        words.append(f"those of {mm:g} mm {'like' if words else 'act like'} {ends} mm")
    less = float(np.mean(acting[thick])) - thick - (float(np.mean(acting[others[-1]])) - others[-1])
    return (
        f"If struts are not printed as drawn, {listed(words)}: beside the thickest, the thinnest come out "
        f"{abs(less):.2g} mm {'thinner' if less > 0 else 'thicker'} than drawn."
    )


def _error(verdict: Verdict) -> str:
    """Root mean square error of the base model on fitted data, with its unit."""
    return f"{verdict.gain.fit.before:.3g} {verdict.gain.fit.unit}".rstrip()


def _shown(verdict: Verdict) -> str:
    """Source of the noise estimate, and its bound, in words."""
    series = [s for s in verdict.record.series if s.group != KNOWN]
    stated = any(noise_limit(verdict.record, s)[1] == STATED for s in series)
    return f"the readings show and the {STATED} allows" if stated else "the readings themselves show"


def _zeros(verdict: Verdict) -> str:
    """Error that the load cell's fitted zeros hide, as a sentence and a space; empty without one."""
    z = verdict.zeros
    if z is None:
        return ""
    return (
        f"That is with the load cell's zero fitted to each test, {z.low:.2g} to {z.high:.2g} {z.unit}; "
        f"without that, it would be {z.error_without:.3g} {z.unit}. "
    )


def _far(verdict: Verdict) -> str:
    """The nuisance farthest from its prior value, with both values, in words."""
    if not verdict.far:
        return "a parameter far from its known value"
    p, value = verdict.far[0], verdict.selection.base.values[verdict.far[0].name]
    unit = f" {p.unit}" if p.unit else ""
    return (
        f"{bare(p)} at {value:.3g}{unit}, where {p.null:.3g} ± {p.spread:.2g}{unit} was expected ({p.source})"
    )


def _near(verdict: Verdict) -> str:
    """The nearest single effect and its share of the misfit, as text."""
    if verdict.nearest is None or verdict.nearest[1] < LEAST_SHARE:
        return "No single effect takes a tenth of the misfit."
    title, share = verdict.nearest
    return f"The nearest single effect, {readable(title)}, takes {100 * share:.3g} % of the misfit (of χ²)."


def _what_remains(verdict: Verdict) -> str:
    """Remaining structure of the misfit when an effect explains nearly all of it."""
    rest = listed([readable(n) for n in verdict.selection.left])
    return (
        f"It takes {100 * verdict.share_taken:.4g} % of the misfit (of χ² beyond noise). What remains "
        f"depends on {rest}: the effect may follow another law, or a small second cause may act as "
        "well, so the intervals are too narrow."
    )


def advice(verdict: Verdict) -> str:
    """Next measurement, as text; without a rigid chamber if an experiment has one."""
    words = _asked(verdict)
    if any(_RIGID.search(f"{e.name} {e.specimen or ''}") for e in verdict.experiments):
        for asked, instead in _INSTEAD.items():
            words = words.replace(asked, instead).replace(_upper(asked), _upper(instead))
    return words


def _asked(verdict: Verdict) -> str:
    if verdict.proposal is not None:
        doubted = [c for c in verdict.selection.causes if c.rivals]
        it = "distinguishes these causes"
        if len(doubted) > 1:
            it = f"shows whether one is {alternatives([doubted[0].effect, *doubted[0].rivals])}"
        return f"{_upper(verdict.proposal.what)}. It {it}."
    found = verdict.selection
    if verdict.kind == "named":
        shown = dict.fromkeys(c.effect.reveals for c in found.causes)
        return f"To confirm it on new data: {'; '.join(shown)}."
    if verdict.kind == "unexplained":
        places = [d for d in found.table if d.against in found.left and d.where and d.against != SPREAD]
        places.sort(key=lambda d: d.p_value)
        at = f" The deviation is largest at: {places[0].where}." if places else ""
        first = places[0].where.partition(", ")[0] if places else ""
        which = first if first in {e.name for e in verdict.experiments} else "an experiment"
        return f"Repeat {which} unchanged: a deviation that does not recur is not a model error.{at}"
    hidden = [s for s in best_seen(verdict.seen).values() if not s.identifiable]
    if not hidden:
        return 'One more experiment like those it is needed for, with role = "held_out", checks that.'
    shows: dict[str, list[str]] = {}
    for s in hidden:
        shows.setdefault(s.effect.reveals, []).append(s.effect.name)
    some = list(shows.items())[:MOST_SHOWN]
    words: list[str] = []
    for what, names in some:
        what = what.replace("; or ", " or ").replace("; ", ", ")
        words.append(f"{what} ({listed([readable(n) for n in dict.fromkeys(names)])})")
    rest = len({s.effect.name for s in hidden} - {n for _, names in some for n in names})
    more = f" {rest} more are hidden, see “Identifiability of each effect” in the report." if rest else ""
    return f"To see effects that these data hide: {'; '.join(words)}.{more}"


def to_do(verdict: Verdict) -> str:
    """Next action, as text; empty if no cause was named."""
    if verdict.kind == "none":
        trust = f"Trust the simulation for experiments like these{_with_moduli(verdict)}"
        return f"{trust}, and set the load cell to zero before each test." if verdict.zeros else f"{trust}."
    if verdict.kind == "ambiguous":
        return "Make the next measurement below before anything is changed."
    if verdict.kind == "unexplained":
        return f"Do not trust the simulation to better than {_error(verdict)} until this is explained."
    doubtful = any(not DECLARED[name].instrument for name in verdict.in_question - {*verdict.names})
    return what_to_do(verdict.names, not (doubtful or verdict.refused or verdict.selection.left))


def _with_moduli(verdict: Verdict) -> str:
    """Fitted factor of a unit's moduli, as text; empty near 1."""
    key = MODULUS.name
    factor = verdict.selection.base.values.get(key, 1.0)
    low, high = verdict.intervals.get(key, (1.0, 1.0))
    if low <= 1.0 <= high or abs(factor - 1.0) < NEAR_ONE:
        return ""
    times = f"{factor:.3g} times the unit's (95 %: {between(low, high)})"
    return f" with --model model.toml, whose moduli are {times}"


def _of_one_only(cause: Cause) -> str:
    if cause.effect.among:
        return f", and differs from {cause.effect.among} to {cause.effect.among}"
    return f", in {cause.effect.whose} only" if cause.effect.whose else ""


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def what_to_do(effects: tuple[str, ...], sure: bool = True) -> str:
    """Remedies for these causes, a sentence each; empty without any.

    sure: nothing inside the simulation would do as well; only then is it said to be right.
    """
    right = "; the simulation is not at fault"
    sentences = (DECLARED[n].remedy + right * (sure and DECLARED[n].instrument) for n in effects)
    return " ".join(f"{text[:1].upper()}{text[1:]}." for text in dict.fromkeys(sentences))
