"""A unit's optimisation: the core's job from the properties, and the results of its run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import bpy

from ...design.parameters import SECTIONS, Unit, read_unit, to_toml
from ...design.quantity import describe
from ...design.repairs import tied
from ...errors import InputError
from ...optimization.freedoms import Freedom, changed_unit
from ...optimization.settings import BODY, DESIGN, HEADER, UNIT
from ...optimization.target_kinds import KINDS
from ...studies.inputs import MODEL
from ...studies.optimize import Optimize, expected_s
from ...toml_writer import toml_text
from ..jobs import prepared
from ..jobs.start_child import JobKind
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..simulate import effects
from ..simulate import study_folder as studies
from ..simulate.study_job import StudyJob
from ..unit import envelope
from ..unit.properties import shape_hash, shape_now, to_unit
from .properties import ASKED, FREE, NAMED, asks_curve, conditions

FOLDER = "optimize"
"""Folder of the optimisation in the unit's study folder."""
TARGET_KEYS = ("name", "asked", "unit", "value", "objective", "met", "robust", "standard_error")


@attrs.frozen(eq=False)
class Proposed:
    """A proposed unit: its file and, as in summary.json, its targets, and texts on changes and reasons.

    targets: of each the values of `TARGET_KEYS`; applied: True if the unit in the scene has its parameters.
    """

    number: int
    file: Path
    targets: tuple[dict[str, Any], ...]
    changes: tuple[str, ...]
    reasons: tuple[str, ...]
    applied: bool = False


@attrs.frozen(eq=False)
class Findings:
    """Results of the optimisation in a unit's folder; other_start: of a unit with other parameters.

    feasible: a unit met every target on the search's mesh; simulated: number of units;
    seconds: of its stages; in_the_way: names of targets, the others can be met without one of these.
    """

    folder: Path
    feasible: bool
    outcome: str
    simulated: int
    seconds: dict[str, float]
    in_the_way: tuple[str, ...]
    proposed: tuple[Proposed, ...]
    other_start: bool = False


def folder_of(root: Any) -> Path:
    """Folder of the unit's optimisation."""
    return studies.folder_of(root) / FOLDER


def plan_of(root: Any) -> list[tuple[str, float]]:
    """Stages of an optimisation, with the expected seconds of each."""
    s = root.mu_optimize
    units = s.evaluations
    found = findings(root)
    taken = {} if found is None else found.seconds
    if found is not None and found.simulated and "search" in taken:
        taken = {**taken, "search": taken["search"] * units / found.simulated}
    return [
        (name, taken.get(name, seconds))
        for name, seconds in expected_s(units, s.refine, s.check_refine, s.self_contact).items()
    ]


OPTIMIZATION = JobKind(
    FOLDER,
    lambda root: root.mu_unit.uuid,
    folder_of,
    "optimisation",
    heavy=True,
    plan_of=plan_of,
    prefix="optimize_",
)


def target_table(target: Any) -> dict[str, Any]:
    """A target of the panel as its [[target]] table."""
    given = {key: _plain(getattr(target, name)) for key, name in conditions(target).items()}
    # A path that is searched for is left out.
    table = {"kind": target.kind} | {key: value for key, value in given.items() if value != ""}
    if KINDS[target.kind].is_yes:
        return table
    if asks_curve(target):
        points = [_numbers(pair, ":") for pair in target.points.split(",")]
        return table | {"points": points, "tolerance": exact(target.tolerance)}
    keys = ASKED[target.ask]
    asked = {key: exact(getattr(target, key)) for key in keys}
    return table | (asked if keys else {"objective": target.ask})


def _plain(value: Any) -> Any:
    """A property's value for a file: numbers by their shortest decimals."""
    if isinstance(value, float):
        return exact(value)
    return value if isinstance(value, str) else [*map(exact, value)]


def _numbers(text: str, between: str) -> list[Any]:
    """Numbers in a text, whole ones as integers; other parts stay text, which the core refuses."""
    found: list[Any] = []
    for part in text.split(between):
        try:
            found.append(int(part) if part.strip().lstrip("+-").isdecimal() else float(part))
        except ValueError:
            found.append(part.strip())
    return found


def freedom_table(freedom: Any) -> dict[str, Any]:
    """A freedom of the panel as its [[freedom]] table, with the parameters tied to it."""
    if freedom.parameter in NAMED:
        names = [name.strip() for name in freedom.values.split(",")]
        return {"parameter": freedom.parameter, "values": [name for name in names if name]}
    section, _, name = freedom.parameter.rpartition(".")
    whole = FREE[freedom.parameter].type is int

    def number(value: float) -> float:
        return round(value) if whole else exact(value)

    table: dict[str, Any] = {"parameter": freedom.parameter}
    if freedom.how == "fixed":
        return table | {"fixed": number(freedom.value)}
    if freedom.how == "values":
        table["values"] = _numbers(freedom.values, ",")
    else:
        table |= {"low": number(freedom.low), "high": number(freedom.high)}
    follows = {f"{section}.{key}": factor for key, factor in tied({name: 1.0}).items() if key != name}
    return table | ({"also": follows} if follows else {})


def document(root: Any) -> dict[str, Any]:
    """Content of design.toml from the panel's targets and freedoms."""
    s = root.mu_optimize
    return {
        **({"orientation_deg": exact(s.orientation_deg)} if s.has_gravity else {}),
        **({"self_contact": True} if s.self_contact else {}),
        "format": 1,
        "unit": UNIT,
        "evaluations": s.evaluations,
        "refine": exact(s.refine),
        "check_refine": exact(s.check_refine),
        "robust": s.robust,
        "target": [target_table(t) for t in s.targets],
        "freedom": [freedom_table(f) for f in s.freedoms],
    }


def _given(root: Any) -> dict[str, Any]:
    """Design and model from a unit's properties; raises InputError."""
    # Imported late: it needs the solver's packages, which a Blender may lack.
    from ...optimization.design_file import parse_design, read_design

    unit, s = to_unit(root.mu_unit), root.mu_optimize
    body = envelope.envelope_in(root, unit)
    if s.source == "file":
        design = read_design(Path(bpy.path.abspath(s.file)), unit if s.own_unit else None, body)
    else:
        design = parse_design(toml_text(document(root)), DESIGN, unit, body=body)
    return {"design": design, "model": _model(root)}


def _hindered(root: Any) -> str:
    """Why a search cannot begin with what the panel has."""
    s = root.mu_optimize
    if s.source == "file":
        return "" if s.file else "Choose a design.toml first"
    if s.targets and s.freedoms:
        return ""
    return f"Add a {'parameter that may change' if s.targets else 'target'} first"


def _model(root: Any) -> Any:
    """The unit's named effects as a file of inputs."""
    text = root.mu_unit.study.effects
    return _Text({MODEL: text}) if text else None


@attrs.frozen
class _Text:
    """A file of inputs that is written and not checked, and those beside it."""

    files: dict[str, str]

    def texts(self) -> dict[str, str]:
        """Its text by name, and theirs."""
        return self.files

    def text(self) -> str:
        """Its own text."""
        return "".join(self.files.values())


def unchecked_texts(root: Any) -> dict[str, str]:
    """The texts of the inputs' files from the panel's lists, by name, not checked; raises InputError."""
    tables, unit = document(root), to_unit(root.mu_unit)
    body = envelope.envelope_in(root, unit)
    fixed = {table["parameter"]: table["fixed"] for table in tables["freedom"] if "fixed" in table}
    beside = {UNIT: to_toml(changed_unit(unit, [Freedom(name) for name in fixed], list(fixed.values())))}
    tables["unit"] = tables.pop("unit")  # last, as the core writes it
    if body is not None:
        tables["body"], beside[BODY] = BODY, body.text()
    design: Any = _Text({DESIGN: toml_text(tables, HEADER), **beside})
    return Optimize(design=design, model=_model(root)).texts()


def _texts(root: Any) -> dict[str, str]:
    """The texts of the inputs' files; raises InputError."""
    own = root.mu_optimize
    files = own.source == "file" or any(".toml" in freedom.values for freedom in own.freedoms)
    if files or prepared.at_once():
        job = OPTIMIZE.inputs(root)
        texts, orientation_deg = job.texts(), job.design.orientation_deg
    else:
        # The job checks them: the packages that this takes would hold the window for a second.
        texts, orientation_deg = unchecked_texts(root), document(root).get("orientation_deg")
    if root.mu_unit.study.effects:
        turned = effects.inputs(root).get("orientation_deg", 0.0)
        if turned != (orientation_deg or 0.0):
            raise InputError(
                f"the unit is turned by {turned:g} degrees in Simulate, but not here",
                "Optimize, Own Weight",
                "turn it equally in both",
            )
    return texts


_units: FileCache[str] = FileCache()


def findings(root: Any) -> Findings | None:
    """Results of the unit's optimisation, or None where none can be read."""
    known = OPTIMIZE.found(root)
    if known is None:
        return None
    found, now = known.content, shape_now(root.mu_unit)
    proposed = tuple(attrs.evolve(p, applied=_hash_of(p.file) == now) for p in found.proposed)
    other = now != _hash_of(found.folder / UNIT) and not any(p.applied for p in proposed)
    return attrs.evolve(found, proposed=proposed, other_start=other)


def _hash_of(file: Path) -> str | None:
    return _units.read([file], lambda: shape_hash(as_kept(read_unit(file))))


def _read(summary: Any, folder: Path) -> Findings:
    """Results by summary.json, in their folder."""
    found, proposed = dict(summary), []
    for number, row in enumerate(map(dict, found.get("proposed") or ()), 1):
        targets = tuple({key: t[key] for key in TARGET_KEYS} for t in row.get("targets") or ())
        texts = (tuple(map(str, row.get(key) or ())) for key in ("changes", "reasons"))
        proposed.append(Proposed(number, folder / Path(str(row["file"])).name, targets, *texts))
    return Findings(
        folder,
        found.get("feasible") is True,
        str(found.get("outcome", "")),
        int(found.get("designs") or 0),
        {name: float(taken) for name, taken in dict(found.get("seconds") or {}).items()},
        tuple(map(str, found.get("in_the_way") or ())),
        tuple(proposed),
    )


OPTIMIZE = StudyJob(
    "optimize",
    OPTIMIZATION,
    folder_of,
    _given,
    hindered=_hindered,
    made_of=_read,
    stale=lambda root, folder: "",
    quick=lambda root: False,
    texts=_texts,
)


def as_kept(unit: Unit) -> Unit:
    """The unit with its numbers rounded to Blender's single precision; raises InputError by a rule."""
    sections = {}
    for section in SECTIONS:
        own = getattr(unit, section.section)
        values = {d.name: exact(getattr(own, d.name)) for d in describe(section) if d.type is float}
        # The bladder is two cells wide to the last digit, see `section_of`.
        ties = tied({"cell_mm": values["cell_mm"]}) if "bladder_diameter_mm" in values else {}
        sections[section.section] = attrs.evolve(own, **values | ties)
    return attrs.evolve(unit, scale=exact(unit.scale), **sections)


def proposed(root: Any) -> tuple[Proposed, ...]:
    """The proposed units; none without results."""
    found = findings(root)
    return () if found is None else found.proposed


def proposed_unit(root: Any, number: int) -> Unit:
    """Proposed unit of a number from 1, from its file; raises InputError without one."""
    rows = proposed(root)
    if not 1 <= number <= len(rows):
        raise InputError(f"no unit {number} is proposed", "Optimize", "run the optimisation first")
    return read_unit(rows[number - 1].file)
