"""Effects a model may lack: mechanisms with parameters that leave the model unchanged at their null."""

from __future__ import annotations

import math
import re

import attrs

from ..errors import InputError

# Another modulus of one specimen: an effect of specimens alone, see `owned`.
BATCH = "batch_variation"
# A mistyped height, a change between two tests, a factor of fast tests: of some experiments alone.
GEOMETRY, STEP, HEATING = "geometry_as_typed", "step_change", "self_heating"
# Struts printed thicker or thinner than drawn, unlike another specimen's: see `owned`.
THICKNESS = "strut_thickness"
# A factor on the force of some tests; of which causes, `scaled_by` tells.
FORCE_SCALE = "force_scale"
# A supply that does not give the pressure that was asked for and logged.
SUPPLY_LIMIT, SUPPLY_RATE = "supply_limit", "supply_rate_limit"
# A load cell off straight, and what of grips and specimen looks like one.
CURVED_CELL, GRIPS = "force_nonlinearity", frozenset(("seating", "frame_compliance"))
# Effects that multiply the modulus in their experiments.
SCALES = frozenset((BATCH, STEP, HEATING))
# A shift of one marker from some moment on, see `prediction.marker_slip`.
SLIP = "marker_slip"
# Faults of one camera, which has one at most: two of them imitate many pairs of physical effects.
CAMERA = frozenset(("camera_scale", "camera_tilt", "camera_perspective", "lens_distortion"))
# Error of the model's own mesh: present in every set of data, seen or not.
NUMERICS = "mesh_error"
EVERY = (-math.inf, math.inf)
# Between a parameter's key and the specimen or experiment that its effect belongs to.
OF = " of "

_HYPHENED = re.compile(r"\b(rate|self)_(independent|heating)")

# What each effect is, and the experiment that shows it best.
LIBRARY = {
    "viscoelasticity": (
        "all moduli relax with time",
        "pressure holds, and one protocol at two rates a decade apart",
    ),
    "rate_independent_hysteresis": ("friction inside the material resists every reversal", "slow loops"),
    "strain_stiffening": ("the material stiffens at large stretch", "an amplitude ladder to full pressure"),
    "mullins_softening": ("the first loading softens all later loading below its peak", "a virgin ladder"),
    "tension_compression_asymmetry": (
        "the stiffness differs between tension and compression",
        "pressure and vacuum",
    ),
    "anisotropy": ("layers make the modulus depend on direction", "specimens printed along x, y and z"),
    "fatigue_drift": ("the modulus falls with the number of cycles", "the first protocol again at the end"),
    "temperature_drift": ("the modulus depends on temperature", "one protocol at two temperatures"),
    "overcure": (
        "light cures resin beyond the nominal surface, so every part is thicker",
        "weighed specimens",
    ),
    "skin_cure": ("the surface is cured more than the core and is stiffer", "coupons of several thicknesses"),
    "wall_thickness": ("the chamber wall is thicker or thinner than nominal", "a section, or the mass"),
    "pressure_offset": (
        "the pressure gauge does not read zero at rest",
        "a record at rest; pressure and vacuum",
    ),
    "pressure_gain": ("the pressure gauge has a gain error", "a dead load, or a second gauge"),
    "pressure_nonlinearity": (
        "the gauge's reading is not proportional to the pressure, by at most 5 % of its largest",
        "the gauge and a second one on the same pressure, in steps up to the largest",
    ),
    "pressure_drift": (
        "the zero of the pressure gauge drifts while it records",
        "the same hold at another pressure; the gauge read at rest for as long",
    ),
    FORCE_SCALE: (
        "the force is scaled: load cell, section as typed, clamping or specimen",
        "a dead weight on the load cell, the section measured, the specimen clamped again",
    ),
    CURVED_CELL: (
        "the load cell's reading is not proportional to the force, by at most 5 % of its largest",
        "dead weights hung from the load cell, in steps up to the largest force",
    ),
    "force_drift": (
        "the zero of the load cell drifts while it records",
        "the load cell read for as long without a specimen",
    ),
    "force_lag": (
        "the filter of the load cell delays its reading",
        "the filter switched off; one protocol at two rates a decade apart",
    ),
    "line_lag": (
        "the resistance of the air line delays the chamber pressure behind the gauge",
        "steps and fast cycles",
    ),
    SUPPLY_LIMIT: (
        "the supply cannot give the largest pressures, which were asked for and logged",
        "a gauge at the unit, read beside the log",
    ),
    SUPPLY_RATE: (
        "the supply cannot change its pressure as fast as was asked for and logged",
        "a gauge at the unit, read beside the log; the same protocol at a third of the rate",
    ),
    "leak": (
        "leaking air flows through the line, so the chamber pressure is nearer the air's than the gauge",
        "a closed valve",
    ),
    "clogged_chamber": ("one chamber receives less pressure than the others", "markers along the unit"),
    "gravity": ("weight bends the unit", "one protocol in three orientations"),
    "contact": ("the unit touches an obstacle", "the same protocol away from every obstacle"),
    "angle_offset": ("the camera's zero angle differs from the unit's", "a record at rest"),
    "angle_drift": (
        "the camera rotates slowly about its optical axis",
        "a mark on the bench, in the same picture",
    ),
    "camera_scale": ("the scale of the camera's picture is wrong", "a ruler in the plane of the markers"),
    "camera_tilt": (
        "the camera does not look at right angles to the plane of bending, so that one direction is "
        "foreshortened",
        "a square of known sides in the plane of bending",
    ),
    "camera_perspective": (
        "the camera does not look at right angles to the plane of bending, so that nearer parts look larger",
        "a square of known sides in the plane of bending; the camera from farther away",
    ),
    "lens_distortion": (
        "the camera's lens distorts its picture",
        "a calibration pattern; the camera from farther away",
    ),
    SLIP: (
        "a marker slips on the unit's surface at one moment and stays there",
        "a mark drawn next to the marker; the marker glued again, and the records after that moment repeated",
    ),
    "inertia": (
        "the unit's mass swings after each change of pressure",
        "the same steps through a narrower line; a ballast on the tip lengthens its period",
    ),
    "clock_offset": ("the clocks of camera and gauge differ", "steps and fast cycles"),
    "seating": (
        "gaps at the specimen's faces close before it carries load",
        "a preload; two specimen lengths",
    ),
    "frame_compliance": (
        "the testing machine deforms",
        "specimens of two sections, which load it by as much more",
    ),
    "led_drift": ("the light source fades", "a straight waveguide over the same time"),
    "ambient_light": ("ambient light adds to the signal", "the light source switched off"),
    "optical_nonlinearity": ("the light loss is not proportional to curvature", "an amplitude ladder"),
    "waveguide_play": (
        "the waveguide has play in its channel, or in the stage that bends it, and stays at each reversal",
        "bending to and fro at two paces: play is as large at either",
    ),
    BATCH: (
        "the modulus of one specimen, or its section as typed, differs from that of the others",
        "another specimen in its place, its height and section measured, clamped again",
    ),
    THICKNESS: (
        "the struts of a specimen are not as thick as drawn, or not those that were drawn",
        "struts of each specimen measured under a microscope, each specimen weighed",
    ),
    GEOMETRY: (
        "a specimen's height differs from the entered one, which scales its strain",
        "the specimen measured with a calliper",
    ),
    STEP: (
        "between two tests something changed and stayed so: a clamp, a setting, damage",
        "the first test again",
    ),
    HEATING: (
        "fast tests are scaled: the specimen warms itself and softens, or its rate stiffens it",
        "the fast test after a pause, and with the rate of the slow one",
    ),
    "mesh_error": ("the mesh of the model is too coarse", "the same simulation on a finer mesh"),
}

# Differences from `LIBRARY` in how an experiment of a kind shows an effect.
SHOWN_BY = {
    ("viscoelasticity", "coupon"): "one coupon at two rates a decade apart, or held at a stretch",
    ("viscoelasticity", "lattice_compression"): "one block at two rates a decade apart, or held",
    ("viscoelasticity", "pressure_hold"): "a longer hold, and the same in a rigid chamber of that volume",
    ("rate_independent_hysteresis", "coupon"): "loading and unloading at two rates a decade apart",
    (
        "rate_independent_hysteresis",
        "lattice_compression",
    ): "loading and unloading at two rates a decade apart",
    ("strain_stiffening", "coupon"): "a test to a larger stretch",
    ("strain_stiffening", "beam_deadweight"): "larger weights",
    ("mullins_softening", "coupon"): "cycles of growing stretch on a coupon that was never loaded",
    ("mullins_softening", "lattice_compression"): "cycles of growing strain on a block that was never loaded",
    ("tension_compression_asymmetry", "coupon"): "one coupon pulled, another compressed",
    ("leak", "pressure_hold"): "the same hold with a plug of metal in the unit's place",
    ("leak", "unit_pressure"): "the valve shut at pressure: any fall is the leak",
    ("line_lag", "unit_pressure"): "steps of pressure, with the camera at 30 frames a second or more",
    ("gravity", "unit_pressure"): "one protocol in three orientations",
    ("gravity", "beam_deadweight"): "the beam upside down",
    ("frame_compliance", "beam_deadweight"): "one load on beams of two lengths",
    ("pressure_gain", "unit_pressure"): "a second gauge on the same pressure",
    ("pressure_gain", "pressure_hold"): "a second gauge on the same pressure",
    ("pressure_offset", "pressure_hold"): "the gauge open to the air before and after",
    (
        "temperature_drift",
        "pressure_hold",
    ): "the same hold reached slowly, so that its gas is not warm at first",
    ("line_lag", "pressure_step"): "the same steps with the gauge at the unit's end of the line",
    ("viscoelasticity", "pressure_step"): "one step held for two decades of time longer",
    ("leak", "pressure_step"): "the valve shut after the step: any fall is the leak",
    ("gravity", "unit_pose"): "a full turn about x at two pressures",
    ("pressure_offset", "blocked_force"): "the gauge open to the air before and after",
    ("seating", "blocked_force"): "the tip run up to the load cell until it reads, before any pressure",
    (
        "frame_compliance",
        "blocked_force",
    ): "a dead weight hung from the load cell, the deflection of its stand measured",
    ("viscoelasticity", "blocked_force"): "the tip blocked at a larger gap, held for two decades of time",
    ("overcure", "unit_pressure"): "the wall of a unit cut open",
    ("wall_thickness", "unit_pressure"): "the wall of a unit cut open",
    ("skin_cure", "unit_pressure"): "coupons of several thicknesses, of the same print",
}


@attrs.frozen
class Parameter:
    """A parameter of a model that can be fitted: unit, bounds, source, and `null`, where it has no effect.

    low, high, null and starts are in `unit`. starts: values from which a fit begins. linear: the prediction
    is affine in it, with a slope independent of the other values. spread: standard deviation of prior
    knowledge, in `unit`; inf without any. experiment: name of the only experiment whose prediction depends on
    it; empty for any. plausible: range for a real specimen, in `unit`; a value beyond suggests that a
    column's unit or sign is wrong. Raises InputError where low is not below high, or the null or a start is
    out of bounds.
    """

    name: str
    unit: str
    low: float
    high: float
    null: float
    starts: tuple[float, ...] = ()
    source: str = ""
    linear: bool = False
    spread: float = math.inf
    experiment: str = ""
    plausible: tuple[float, float] = EVERY

    def __attrs_post_init__(self) -> None:
        inside = [self.null, *self.starts]
        if not (self.low < self.high and all(self.low <= v <= self.high for v in inside)):
            raise InputError(
                f"{self.name}: null or a start is out of bounds",
                "effect library",
                f"keep them from {self.low:g} to {self.high:g}",
            )

    def narrowed(self, low: float, high: float) -> Parameter:
        """The same parameter within [low, high] and its own bounds, in its unit.

        Starts outside are dropped; if none is left, the middle of the new bounds takes their place. Raises
        InputError where the null is out of the new bounds.
        """
        low, high = max(self.low, low), min(self.high, high)
        starts = tuple(v for v in self.starts if low <= v <= high)
        if self.starts and not starts:
            starts = (0.5 * (low + high),)
        return attrs.evolve(self, low=low, high=high, starts=starts)

    @property
    def step(self) -> float:
        """Step of a finite difference at the null, in the parameter's unit; negative if `high` is near.

        A thousandth of the range or, if smaller, of the distance from the null to the nearest start.
        """
        away = [abs(v - self.null) for v in self.starts if v != self.null]
        size = 1e-3 * min(self.high - self.low, *away) if away else 1e-3 * (self.high - self.low)
        return size if self.null + size <= self.high else -size


def factor(name: str, start: float, source: str, plausible: tuple[float, float] = EVERY) -> Parameter:
    """A factor less 1, from a hundredth to ten times: one range for effects that act alike on data.

    A rival is not excluded by a narrower range of its own. plausible: range in which it may be named a cause;
    beyond it stays a rival, and keeps a verdict open.
    """
    return Parameter(name, "", -0.99, 9.0, 0.0, (start,), source, plausible=plausible)


@attrs.frozen
class Effect:
    """Physics that the base model lacks; `kinds` are the experiments it can be seen in.

    parameters: the first is its size, whose null switches the effect off exactly; the others give its shape.
    mechanism, reveals: texts, by default of `LIBRARY` and `SHOWN_BY`. whose: the one specimen or experiment
    that has it, "specimen B"; empty for all. among: owners with separate sizes, "specimen"; spread: their
    standard deviation, in the parameters' unit, with its 95 % interval. refines: a law with more freedom than
    another of its name, fitted only in its place. tried: number of alternatives among which its starts were
    chosen. Raises InputError for a name not in `LIBRARY`.
    """

    name: str
    parameters: tuple[Parameter, ...]
    kinds: tuple[str, ...]
    mechanism: str = attrs.field()
    reveals: str = attrs.field()
    whose: str = ""
    among: str = ""
    spread: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    refines: bool = False
    tried: int = 1

    @mechanism.default
    def _of_library(self) -> str:
        return LIBRARY.get(self.name, ("", ""))[0]

    @reveals.default
    def _shown_by(self) -> str:
        usual = LIBRARY.get(self.name, ("", ""))[1]
        shown = dict.fromkeys(SHOWN_BY.get((self.name, kind), usual) for kind in self.kinds)
        return "; or ".join(shown) or usual

    def __attrs_post_init__(self) -> None:
        if self.name not in LIBRARY or not self.parameters:
            raise InputError(
                f"no effect {self.name!r} is known", "effect library", f"known: {', '.join(LIBRARY)}"
            )

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of its parameters in the values of a prediction, "effect.parameter"; the size is first.

        Of one specimen's effect "effect.parameter of specimen B".
        """
        of = f"{OF}{self.whose}" if self.whose else ""
        return tuple(f"{self.name}.{p.name}{of}" for p in self.parameters)

    @property
    def title(self) -> str:
        """Its name, with its specimen or experiment if it has one."""
        if self.among:
            return f"{self.name} among {self.among}s"
        return f"{self.name}{OF}{self.whose}" if self.whose else self.name

    def starts(self) -> tuple[dict[str, float], ...]:
        """Values, by key, from which fits begin: every combination of its parameters' starts.

        A parameter without starts takes its null. Each value is in its parameter's unit.
        """
        combined: list[dict[str, float]] = [{}]
        for key, p in zip(self.keys, self.parameters, strict=True):
            combined = [{**c, key: v} for c in combined for v in (p.starts or (p.null,))]
        return tuple(combined)

    def shapes(self) -> tuple[dict[str, float], ...]:
        """The combinations of `starts` with the size (first parameter) at its null, each once, by key.

        Each value is in its parameter's unit.
        """
        key, size = self.keys[0], self.parameters[0]
        found = []
        for start in self.starts():
            shape = {**start, key: size.null}
            if shape not in found:
                found.append(shape)
        return tuple(found)


def readable(name: str) -> str:
    """An effect's or quantity's name for a reader."""
    return _HYPHENED.sub(r"\1-\2", name).replace("_", " ")


def bare(p: Parameter) -> str:
    """A parameter's name for a reader, without the unit that follows its value."""
    unit = p.unit.replace("1/", "per_").replace("/h", "_per_hour").replace("/", "_")
    name, of, whose = p.name.partition(OF)
    return readable(name.removesuffix(f"_{unit}") if unit else name) + of + whose
