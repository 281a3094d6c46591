"""`design-experiments`: which effects planned experiments can detect, and the smallest detectable sizes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import attrs

from .. import design, evidence, measured
from ..errors import InputError
from ..measured.kinds import NOISE, OF_A_UNIT
from ..meshing.settings import SELF_CONTACT
from ..run.parts import Part, Sentence, Table, Warn, csv, echo, listed, recorded
from ..run.study import Found, Input, Study, Tell, Written, derived, given, section, setting, stage
from .inputs import MeasuredInput, UnitInput, asked

# Stages as `evidence.simulations_plan` names them.
LATTICE, FREE, HELD = "lattice", "unit", "unit with its tip held"
# Half of the variance wanders, as slowly as a tenth of the longest record.
SLOW = 0.1
# Effects that look as much alike as this cannot be distinguished.
ALIKE = 0.95
Simulated = tuple[dict[str, Any], list[str]]
Experiments = tuple["measured.Experiment", ...]


@attrs.frozen
class NoiseInput(Input):
    """Standard deviation of a reading, by quantity, in the unit of its column."""

    kind: str = "noise"
    many: bool = True

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> dict[str, float]:
        """The noise of texts like "angle=0.5", the rest as in `NOISE`; raises InputError."""
        found = dict(NOISE)
        for word in values[0]:
            name, _, text = word.partition("=")
            try:
                value = float(text)
            except ValueError:
                value = math.nan
            if name not in NOISE or not (math.isfinite(value) and value > 0):
                remedy = f"write QUANTITY=VALUE, of {', '.join(NOISE)}"
                raise InputError(f"{word!r} is not a noise level", "--noise", remedy)
            found[name] = value
        return found

    def write(self, name: str, value: Mapping[str, float]) -> Written:
        """A key for each quantity."""
        return Written(value)

    def read(self, name: str, found: Found) -> dict[str, float]:
        """The noise of the keys; raises InputError."""
        there = [quantity for quantity in NOISE if quantity in found.keys]
        return self.made(([f"{quantity}={found.keys.pop(quantity)}" for quantity in there],), found.given)


@attrs.frozen(eq=False)
class Plan:
    """Results of planned experiments: every effect, visible ones first; alike: pairs with their cosine."""

    seen: tuple[evidence.Sensitivity, ...]
    alike: tuple[tuple[str, str, float], ...]

    def like(self, name: str) -> list[str]:
        """Effects that cannot be distinguished from one."""
        return [b if a == name else a for a, b, _ in self.alike if name in (a, b)]


def _subject(unit: design.Unit | None, study: Any) -> design.Unit | None:
    """Unit that the experiments are made with."""
    return evidence.unit_behind(study.data.experiments, unit)


def _seconds(title: str) -> Callable[[DesignExperiments], float]:
    return lambda study: dict(
        evidence.simulations_plan(study.data.experiments, study.unit, study.settings(study.self_contact))
    ).get(title, 0.1)


def _wanted(title: str) -> Callable[[DesignExperiments], bool]:
    return lambda study: title in study.simulated


@attrs.frozen(kw_only=True, eq=False)
class DesignExperiments(Study):
    """Design experiments before measuring: compute which effects planned experiments can detect, and the
    smallest detectable size of each.
    """

    name = "design-experiments"
    example = "design-experiments my-protocols --noise angle=0.5 --out out/plan"
    files = {"limits.csv": "detection limit of every effect, and those that it looks like"}

    data: measured.Measured = asked(
        MeasuredInput,
        "folder",
        "folder of planned experiments, in the format of `diagnose`; the measured columns may hold any "
        "numbers",
        empty=attrs.NOTHING,
    )
    unit: design.Unit | None = given(
        UnitInput(needed=False),
        default=None,
        converter=attrs.Converter(_subject, takes_self=True),
    )
    self_contact: bool = setting(SELF_CONTACT)
    noise: dict[str, float] = asked(
        NoiseInput,
        "noise",
        "standard deviation of a reading, in the unit of its column; empty: "
        + " ".join(f"{quantity}={value:g}" for quantity, value in NOISE.items()),
        empty=attrs.Factory(lambda: dict(NOISE)),
        metavar="QUANTITY=VALUE",
    )

    @property
    def simulated(self) -> set[str]:
        """Titles of the simulations that the experiments need."""
        kinds = {e.kind for e in self.data.experiments}
        found = {LATTICE} if any(e.cells for e in self.data.experiments) else set()
        found |= {FREE} if kinds & set(OF_A_UNIT) - {"blocked_force"} else set()
        return found | ({HELD} if "blocked_force" in kinds else set())

    @derived
    def settings(self, self_contact: bool) -> evidence.UnitSettings:
        """Settings of the unit's simulation: of every effect at its first sizes alone."""
        return evidence.UnitSettings(self_contact=self_contact, whole=None)

    @derived
    def experiments(self, data: measured.Measured) -> Experiments:
        """The planned experiments."""
        return data.experiments

    @stage(LATTICE, _seconds(LATTICE), wanted=_wanted(LATTICE), kept=False)
    def lattice(self, experiments: Experiments, unit: design.Unit, tell: Tell) -> Simulated:
        """Response of compressed blocks to printing, and how they are modelled."""
        return evidence.scalings(experiments, unit, tell.cache, lambda _, share: tell(share))

    @stage(FREE, _seconds(FREE), wanted=_wanted(FREE), kept=False)
    def free(
        self,
        experiments: Sequence[measured.Experiment],
        unit: design.Unit,
        settings: evidence.UnitSettings,
        tell: Tell,
    ) -> Simulated:
        """Simulators of a unit that bends freely, and what they leave out."""
        return evidence.of_a_unit(experiments, unit, tell.cache, tell, settings)

    @stage(HELD, _seconds(HELD), wanted=_wanted(HELD), kept=False)
    def held(
        self,
        experiments: Sequence[measured.Experiment],
        unit: design.Unit,
        settings: evidence.UnitSettings,
        tell: Tell,
    ) -> Simulated:
        """Simulators of a unit whose tip is held, and what they leave out."""
        return evidence.of_a_unit(experiments, unit, tell.cache, tell, settings, held=True)

    @stage("sensitivities", 1.5, kept=False)
    def found(
        self, experiments: Experiments, noise: Mapping[str, float],
        lattice: Simulated | None = None, free: Simulated | None = None, held: Simulated | None = None,
    ) -> Plan:  # fmt: skip
        """Detection limits with these instruments."""
        simulators = evidence.bench_simulators(experiments, lattice[0] if lattice else {})
        for simulated, _ in filter(None, (free, held)):
            simulators |= simulated
        return plan(experiments, evidence.Composite(simulators), noise)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it their number."""
        count = len(self.data.experiments)
        return (
            f"Experiments planned in {self.data.folder.resolve().name}",
            f"{count} experiment{'s' if count != 1 else ''}, planned",
        )

    @section()
    def answer(
        self, found: Plan, noise: Mapping[str, float],
        lattice: Simulated | None = None, free: Simulated | None = None, held: Simulated | None = None,
    ) -> Iterator[Part]:  # fmt: skip
        """How many effects are detected, and which."""
        for words in [words for one in (free, held) if one for words in one[1]]:
            yield Warn(words, "unit", repeated=False)
        for words in [words for one in (lattice, free, held) if one for words in one[1]]:
            yield Sentence(words, note=True)
        visible = {s.effect.name: [_limit(s), s.limit] for s in found.seen if s.identifiable}
        hidden = {s.effect.name: s.effect.reveals for s in found.seen if not s.identifiable}
        share = f"{len(visible)} of {len(found.seen)}"
        yield Sentence(f"These experiments can detect {share} effects.", answer=True, strong=share)
        yield recorded("visible", visible)
        yield recorded("hidden", hidden)
        yield recorded("alike", [list(pair) for pair in found.alike])
        yield recorded("noise", dict(noise))
        readable = evidence.readable
        lines = [f"{readable(name)}: detectable from {limit}" for name, (limit, _) in visible.items()]
        if hidden:
            lines.append(f"not detectable: {listed([readable(n) for n in hidden])}")
        lines += [
            f"similar signatures: {readable(a)} and {readable(b)} ({c:.3f})" for a, b, c in found.alike[:5]
        ]
        yield from echo(*lines)

    @section("limits", "Detectable effects")
    def limits(self, found: Plan) -> Iterator[Part]:
        """Every effect, and what hides it."""
        columns = ["effect", "parameter", "unit", "visible_from", "not_absorbed", "visible", "looks_like"]
        table = []
        rows = []
        for s in found.seen:
            p, alike = s.effect.parameters[0], found.like(s.effect.name)
            visible = int(s.identifiable)
            table.append((s.effect.name, p.name, p.unit, s.limit, s.unabsorbed, visible, " ".join(alike)))
            reason = ""
            if not visible:
                by = listed([evidence.readable(n) for n in s.absorbed_by]) if s.absorbed_by else ""
                absorbed = by and s.unabsorbed
                reason = f"absorbed by {by}" if absorbed else "no measured quantity depends on it"
            rows.append(
                (
                    evidence.readable(s.effect.name),
                    _limit(s),
                    f"{s.unabsorbed:.1%}" if s.unabsorbed else "–",
                    reason,
                    listed([evidence.readable(a) for a in alike]) if alike else "",
                    s.effect.reveals,
                )
            )
        yield csv("limits.csv", columns, table)
        yield Sentence(
            "An effect of the given size is detected in nearly every set of such data (χ² of 16). “Not "
            "absorbed” is the share of its signature that fitted moduli and zeros cannot reproduce. Effects "
            f"whose signatures have a similarity above {ALIKE:g} (cosine) can be distinguished only by "
            "another experiment."
        )
        head = [
            "effect",
            ("detectable from", "line"),
            ("not absorbed", "n"),
            ("reason if not", "text"),
            ("similar to", "text"),
            ("best experiment to detect it", "text"),
        ]
        yield Table("", head, rows, [k for k, s in enumerate(found.seen) if s.identifiable])

    @section("noise", "Noise of a reading")
    def instruments(self, noise: Mapping[str, float]) -> Iterator[Part]:
        """The noise that was assumed."""
        head = ["quantity", "in the unit of its column"]
        yield Table("", head, [(evidence.readable(k), v) for k, v in noise.items()])


def plan(
    experiments: Sequence[measured.Experiment],
    simulator: evidence.Composite,
    noise: Mapping[str, float] = NOISE,
) -> Plan:
    """Plan of experiments, whatever they measured so far."""
    from ..evidence.record import record
    from ..evidence.sensitivity import sensitivities, similarity

    expected = tuple(_expected(e, simulator) for e in experiments if simulator.knows(e))
    planned = record(expected, simulator)
    fitter = evidence.Fitter(planned, simulator, _sources(planned, noise))
    values = {p.name: p.null for p in fitter.curved}
    # Of each effect the shape that is seen soonest.
    least: dict[str, evidence.Sensitivity] = {}
    for s in sensitivities(fitter, values):
        if s.effect.name not in least or s.limit < least[s.effect.name].limit:
            least[s.effect.name] = s
    seen = sorted(least.values(), key=lambda s: (not s.identifiable, s.limit))
    shown = [s for s in seen if s.identifiable]
    alike = []
    if len(shown) > 1:
        cosines = similarity(shown)
        for i, a in enumerate(shown):
            for j in range(i + 1, len(shown)):
                if abs(cosines[i, j]) > ALIKE:
                    alike.append((a.effect.name, shown[j].effect.name, float(cosines[i, j])))
    return Plan(tuple(seen), tuple(sorted(alike, key=lambda p: -abs(p[2]))))


def _expected(e: measured.Experiment, simulator: evidence.Composite) -> measured.Experiment:
    """The experiment with the base model's prediction as its data."""
    columns = dict(zip(simulator.channels(e), simulator.predict(e, {}), strict=True))
    # Channels that are alike to the last digit would be taken for one.
    columns = {c: y + 1e-9 * k for k, (c, y) in enumerate(columns.items())}
    return attrs.evolve(e, columns={**e.columns, **columns})


def _sources(planned: evidence.Record, noise: Mapping[str, float]) -> dict[str, evidence.Source]:
    from ..evidence.record import KNOWN

    found = {}
    for group in planned.groups:
        if group == KNOWN:
            continue
        members = [s for s in planned.series if s.group == group]
        head = members[0].channel.rpartition("_")[0]
        quantity = "marker" if head.startswith("marker") else head
        if quantity not in noise:
            raise InputError(
                f"no noise level of {quantity} is given", "--noise", f"known: {', '.join(noise)}"
            )
        size = noise[quantity] * math.sqrt(0.5)
        times = [s.time_s for s in members if not math.isnan(s.sample_s)]
        longest = max((float(t[-1] - t[0]) for t in times), default=1.0)
        found[group] = evidence.Source(
            size if times else noise[quantity], size if times else 0.0, SLOW * longest
        )
    return found


def _limit(s: evidence.Sensitivity) -> str:
    p = s.effect.parameters[0]
    return f"{evidence.bare(p)} {s.limit:.3g} {p.unit}".strip() if s.identifiable else "not detectable"
