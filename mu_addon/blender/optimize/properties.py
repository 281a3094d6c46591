"""Targets and free parameters of a unit, as Blender properties on its object."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import CollectionProperty, StringProperty

from ...chain.settings import GRAVITY
from ...design import lattice_kinds
from ...design.anchors import windows
from ...design.assets import asset_names
from ...design.quantity import Description
from ...design.settings import ORIENTATION
from ...errors import InputError
from ...optimization.freedoms import PATH, RESIN, parameters
from ...optimization.settings import CHECK_REFINE, EVALUATIONS, ROBUST, SELF_CONTACT
from ...optimization.settings import REFINE as SEARCH_REFINE
from ...optimization.target_kinds import GAP, KINDS, PRESSURE
from ..shared.blender_property import (
    Choice,
    Flag,
    Number,
    Text,
    blender_property,
    exact,
    path_property,
)
from ..shared.registration import property_of
from ..shared.wording import label, sentence
from ..unit.fields import path_menu, true_scale
from ..unit.properties import section_of, to_unit

SECTIONS = ("chambers", "lattice", "grading", "material")
"""Sections whose numbers may be free; those of sensor, printer and laws with history are not offered."""
FREE = {
    name: d
    for name, d in parameters().items()
    if d.type in (int, float) and (name in ("scale", "waveguide.row") or name.split(".")[0] in SECTIONS)
}
"""Parameters that the panel offers to be free, by dotted name."""
NAMED = {
    "lattice.kind": ("Lattice: Kind", "Kind of lattice cell"),
    PATH: ("Sensor: Path", "Path of the sensor, used for a target with an empty path"),
    RESIN: ("Resin", "Resin of the library: its moduli, density and elongation at break"),
}
"""Choices by name instead of numbers: the label of each, and its description."""
AROUND = 0.25
"""Share of its value by which a newly freed parameter may first change to either side."""

ASKED = {"low": ("low",), "high": ("high",), "range": ("low", "high"), "value": ("value", "tolerance")}
ASKED |= {"curve": ("points", "tolerance"), "minimise": (), "maximise": ()}
"""Fields that each way of asking needs."""


def _number(name: str, description: str, default: float, **more):
    return Number(name, description, default=default, precision=3, **more)


class MU_PG_target(bpy.types.PropertyGroup):
    """One target of a design: a quantity and its goal."""

    kind: Choice(
        "Quantity",
        "Quantity of the target",
        items=[(name, name.replace("_", " ").title(), sentence(kind.text)) for name, kind in KINDS.items()],
    )
    pressure_kPa: blender_property(PRESSURE, name="At (kPa)", precision=1, step=100)
    pressures_kPa: blender_property(
        PRESSURE._replace(text="two gauge pressures over which it is taken"),
        name="At (kPa)",
        size=2,
        default=(-15.0, 30.0),
        precision=1,
        step=100,
    )
    direction: Choice("Along", "Direction of the force", items=[(axis, axis.upper(), "") for axis in "xyz"])
    toward: Choice(
        "Along",
        "Direction of the displacement",
        items=[("y", "Y", "Toward which the unit bends"), ("z", "Z", "Along the axis")],
    )
    gap_mm: blender_property(GAP, precision=2)
    points: Text(
        "Curve", "Pressure in kPa and value of each point, as -15: -10, 30: 16", default="-15: -10, 30: 16"
    )
    path: StringProperty(default="alpha4", options={"HIDDEN"})
    paths: path_menu(lambda target: target.id_data.mu_unit.chambers.count, "The One Searched For")
    ask: Choice(
        "Shall Be",
        "Goal of the quantity",
        items=[
            ("low", "At Least", "Not less than a bound"),
            ("high", "At Most", "Not more than a bound"),
            ("range", "Between", "Within two bounds"),
            ("value", "Equal to", "A value within a tolerance"),
            ("curve", "On a Curve", "Values at several pressures, each within a tolerance"),
            ("minimise", "As Small as Possible", "An objective: several of them give a Pareto front"),
            ("maximise", "As Large as Possible", "An objective: several of them give a Pareto front"),
        ],
    )
    value: _number("Value", "In the quantity's unit", 20.0)
    tolerance: _number("Within", "Tolerance: allowed deviation of the value from the goal", 1.0, min=1e-6)
    low: _number("Least", "Lower bound, in the quantity's unit", 20.0)
    high: _number("Most", "Upper bound, in the quantity's unit", 30.0)


def asks_curve(target) -> bool:
    """Return True if a target is a curve over pressure; never for one without a number."""
    return bool(target.ask == "curve" and not KINDS[target.kind].is_yes)


def conditions(target) -> dict[str, str]:
    """Property of each key that a target's table takes beside its goal; a curve has its own pressures."""
    own = {"direction": "toward"} if target.kind == "tip_position" else {}
    left = ("region", *[PRESSURE.name] * asks_curve(target))
    return {key: own.get(key, key) for key in KINDS[target.kind].takes if key not in left}


def _first_range(freedom, context) -> None:
    """Set a parameter's first range around the unit's present value, within the parameter's bounds."""
    if freedom.parameter in NAMED:
        freedom.values = ", ".join(names_of(freedom.id_data, freedom.parameter))
        return
    d, now = FREE[freedom.parameter], present(freedom.id_data, freedom.parameter)
    whole = d.type is int
    step = max(abs(now) * AROUND, float(whole))
    low, high = max(now - step, d.low), min(now + step, d.high)
    if whole:
        low, high = round(low), round(high)
    if not low < high:
        low, high = d.low, d.high
    freedom.low, freedom.high = float(f"{low:.4g}"), float(f"{high:.4g}")
    freedom.value, freedom.values = now, ", ".join(f"{v:.4g}" for v in (low, now, high))


def present(root, name: str) -> float:
    """A unit's own value of a parameter by its dotted name."""
    section, _, key = name.rpartition(".")
    if not section:
        return exact(root.mu_unit.scale)
    return section_of(root.mu_unit, section)[key]


def names_of(root, name: str) -> list[str]:
    """All names that a freedom of `NAMED` may have; no path for a unit that breaks a rule."""
    if name == PATH:
        try:
            return [w.name for w in windows(to_unit(root.mu_unit).chambers.count)]
        except InputError:
            return []
    if name == RESIN:
        return asset_names("materials")
    own = root.mu_unit.lattice.struts
    return [kind for kind in lattice_kinds.names() if own or kind != lattice_kinds.CUSTOM]


def title(name: str, d: Description) -> str:
    """Title of a parameter in a list: its section and its label, as "Chambers: Wall"."""
    section = name.rpartition(".")[0]
    return f"{sentence(section)}: {label(d)}" if section else label(d)


def scale_of(freedom) -> float:
    """True millimetres in one of the parameter's; 1 if it is not a length or the same at every scale."""
    d = FREE.get(freedom.parameter)
    return 1.0 if d is None or d.unit != "mm" else true_scale(freedom.id_data.mu_unit, d)


def _true(name: str, title: str):
    """Value `name` of a freedom at the unit's scale."""

    def read(freedom) -> float:
        return getattr(freedom, name) * scale_of(freedom)

    def write(freedom, value: float) -> None:
        setattr(freedom, name, value / scale_of(freedom))

    words = f"{title}, at the unit's scale"
    return Number(title, words, get=read, set=write, precision=3, options={"SKIP_SAVE"})


def _scaled(values: str, factor: float, digits: int) -> str:
    """Numbers between commas times a factor; other parts stay, for the core to refuse."""

    def scaled(part: str) -> str:
        try:
            return f"{float(part) * factor:.{digits}g}"
        except ValueError:
            return part.strip()

    return ", ".join(scaled(part) for part in values.split(","))


def _true_values():
    """The list of values of a freedom at the unit's scale."""

    def read(freedom) -> str:
        return _scaled(freedom.values, scale_of(freedom), 9)

    def write(freedom, values: str) -> None:
        # More digits than are read, so that what was typed is what is shown.
        freedom.values = _scaled(values, 1.0 / scale_of(freedom), 15)

    words = "The values, at the unit's scale, as 0.7, 0.9, 1.1"
    return Text("Values", words, get=read, set=write, options={"SKIP_SAVE"})


class MU_PG_freedom(bpy.types.PropertyGroup):
    """One parameter that may change, and its range."""

    parameter: Choice(
        "Parameter",
        "What may change",
        items=[(name, title(name, d), sentence(d.text)) for name, d in FREE.items()]
        + [(name, *words) for name, words in NAMED.items()],
        default="chambers.wall_mm",
        update=_first_range,
    )
    how: Choice(
        "May Be",
        "How the parameter may change",
        items=[
            ("range", "Between", "Any value between two bounds"),
            ("values", "One of", "One of some values"),
            ("fixed", "Fixed at", "One value, which the search keeps"),
        ],
    )
    values: Text(
        "Values", "The values, in the parameter's unit at scale 1, as 0.7, 0.9, 1.1; or the names", default=""
    )
    value: _number("Value", "In the parameter's unit at scale 1", 0.9)
    low: _number("From", "Lowest value, in the parameter's unit at scale 1", 0.7)
    high: _number("To", "Highest value, in the parameter's unit at scale 1", 1.3)
    true_value: _true("value", "Value")
    true_values: _true_values()
    true_low: _true("low", "From")
    true_high: _true("high", "To")


@property_of(bpy.types.Object, "mu_optimize")
class MU_PG_optimize(bpy.types.PropertyGroup):
    """Targets and freedoms of a unit, and settings of the search."""

    source: Choice(
        "Targets",
        "Where targets and freedoms are given",
        items=[
            ("panel", "Listed Here", "Targets and freedoms of the lists below"),
            ("file", "In a File", "Those of a design.toml"),
        ],
    )
    file: path_property("File", "design.toml with targets and freedoms")
    own_unit: Flag(
        "Start from This Unit",
        "The search starts from this unit in place of the one that the file names",
        default=True,
    )
    targets: CollectionProperty(type=MU_PG_target, description="Targets of the unit")
    freedoms: CollectionProperty(type=MU_PG_freedom, description="What may change")
    robust: blender_property(ROBUST)
    self_contact: blender_property(SELF_CONTACT, name="Self-Contact")
    has_gravity: blender_property(
        GRAVITY._replace(default=False, text=f"{GRAVITY.text}; then an angle at 0 kPa can be a target"),
        name="Own Weight",
    )
    # Horizontal, where weight matters most.
    orientation_deg: blender_property(
        ORIENTATION._replace(default=90.0), name="Turned by (deg)", precision=1, step=100
    )
    evaluations: blender_property(EVALUATIONS, name="Units at Most")
    refine: blender_property(SEARCH_REFINE, name="Search Mesh", precision=2, step=5)
    check_refine: blender_property(CHECK_REFINE, name="Check Mesh", precision=2, step=5)
