"""A unit with the effects of an extended model (model.toml) in its parameters and mechanics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import attrs

from ..design.parameters import Unit
from ..diagnose.words import alternatives
from ..errors import InputError
from ..evidence.effect import readable
from ..evidence.effects import STATIC as EFFECTS
from ..evidence.extended import ExtendedModel, Fitted, load_model
from ..evidence.lattice_fem import printed
from ..evidence.prediction.lattice_compression import SLENDER, ComputedCell
from ..evidence.unit_body import Body
from ..run.parts import listed
from .named_effects import NAMES, NamedEffects, law_within

Values = Mapping[str, Fitted]
# A unit with a value in it, and the changes in words.
Put = Callable[[Unit, float], tuple[Unit, str]]

# Effects that the unit has parameters for.
_DESCRIPTIONS = {
    "overcure": "every printed surface moves outward by {:.3g} mm",
    "skin_cure": "a skin of {:.3g} mm times the excess of its modulus over the core's",
    "wall_thickness": "walls are {:.3g} times as thick as drawn",
}
# Effects that a simulation gets otherwise.
_ELSEWHERE = {
    "contact": "obstacles are given with --obstacle",
}
_NOWHERE = (
    "it concerns a gauge, a clock, a camera or the bench, which a simulation of the unit does not contain"
)

# What codes and meshes differ by is part of no unit.
OF_THE_MODEL = ("discrepancy_", "mesh_share")
_OTHER_KIND = "its parameters are of another kind of experiment than a whole unit under pressure"


@attrs.frozen
class Extended:
    """A unit with an extended model applied; applied, left_out: parts of the model, as text.

    doubt: why its verdict is no reason to apply it, and the rivals of what is applied; "" if it is. effects:
    those of the simulation, not of a unit's parameters. kept: the model with these effects alone.
    """

    unit: Unit
    applied: tuple[str, ...]
    left_out: tuple[str, ...]
    doubt: str
    effects: NamedEffects
    kept: ExtendedModel

    def of_parameters(self) -> Extended:
        """The extended unit reduced to its parameters, for jobs that do not simulate the whole unit."""
        beyond = self.effects.words()
        whole = tuple(f"{words}: only `simulate` and `place` simulate the whole unit" for words in beyond)
        applied = tuple(words for words in self.applied if words not in beyond)
        return attrs.evolve(self, applied=applied, left_out=(*self.left_out, *whole), effects=NamedEffects())


def read_extended(unit: Unit, path: str | Path) -> Extended:
    """The unit with the model of a file in it; raises InputError for a file or value that cannot be used."""
    return extend(unit, load_model(Path(path)), str(path))


def extend(unit: Unit, model: ExtendedModel, origin: str = "model.toml") -> Extended:
    """The unit with a model in it. Raises InputError where the unit breaks a rule, or an effect its bounds.

    overcure moves the print's surfaces, skin_cure gives it a skin, wall_thickness changes its wall, and
    moduli that were fitted take the place of the unit's. A fitted modulus of the lattice is that of the drawn
    lattice at 1.0x, so the unit gets the modulus at its scale. Effects without a parameter of the unit go
    into its simulation, see `NamedEffects`, except effects of experiments on something else than a unit.
    """
    applied: list[str] = []
    left_out: list[str] = []
    laws = {n: law for n, v in model.effects.items() if n in NAMES and (law := law_within(n, v))}
    beside = {n: {p.name: model.effects[n][p.name] for p in law} for n, law in laws.items()}
    for name, given in model.effects.items():
        # A mechanism may have been found in other kinds of experiments as well.
        values = {p: fitted for p, fitted in given.items() if p not in beside.get(name, {})}
        if not values:
            continue
        effect = EFFECTS.get(name)
        known = effect is not None and tuple(values) == (effect.parameter.name,)
        put = _of_effect(name) if known and name in _DESCRIPTIONS else None
        if put is None:
            why = _ELSEWHERE.get(name, _OTHER_KIND if name in NAMES else _NOWHERE)
            left_out.append(f"{readable(name)} ({_listed_values(values)}): {why}")
            continue
        for p, fitted in values.items():
            unit, words = _put(unit, origin, f"{name}.{p}", fitted, put)
            applied.append(words)
    for name, fitted in model.nuisances.items():
        if name == "modulus_factor":
            unit, words = _put(unit, origin, name, fitted, _all_moduli)
            applied.append(words)
        elif name == "lattice_modulus_kPa":
            unit, words = _put(unit, origin, name, fitted, _as_printed(model))
            applied.append(words)
        elif not name.startswith(OF_THE_MODEL):
            left_out.append(
                f"{readable(name)} ({fitted.value:.4g}) is an effect of the test bench, not of the unit"
            )
    named = {name: {p: fitted.value for p, fitted in values.items()} for name, values in beside.items()}
    effects = NamedEffects(named, where=f"{origin}, [effect]")
    applied += effects.words()
    kept = {n: v for n, v in beside.items() if n in effects.values}
    return Extended(
        unit,
        tuple(applied),
        tuple(left_out),
        _doubt(model) if applied or model.verdict == "unexplained" else "",
        effects,
        ExtendedModel(model.verdict, kept, {}, rivals=model.rivals if kept else ()),
    )


def _doubt(model: ExtendedModel) -> str:
    """Why a model's verdict is no reason to apply it, continuing "the model's ..."; "" if it is."""
    if model.verdict == "ambiguous":
        applied = listed([readable(name) for name in model.effects]) if model.effects else "the one applied"
        rivals = alternatives(model.rivals) if model.rivals else "another cause, see its report"
        return (
            f"verdict is ambiguous: the data fit {applied}, and equally {rivals}, which may move the unit "
            "otherwise"
        )
    if model.verdict == "unexplained":
        return "verdict is unexplained: the model is wrong, and it contains no effect that corrects it"
    return ""


def _put(unit: Unit, origin: str, key: str, fitted: Fitted, put: Put) -> tuple[Unit, str]:
    try:
        return put(unit, fitted.value)
    except InputError as error:
        raise InputError(
            f"the unit cannot have {key} = {fitted.value:.4g}: {error.what}", origin, error.remedy
        ) from error


def _listed_values(values: Values) -> str:
    return ", ".join(f"{p} {f.value:.4g}" for p, f in values.items())


def _of_effect(name: str) -> Put:
    """An effect put into a unit as in the evidence's simulator."""
    change = EFFECTS[name].body
    assert change is not None

    def put(unit: Unit, size: float) -> tuple[Unit, str]:
        return change(Body(unit), size).unit, _DESCRIPTIONS[name].format(size)

    return put


def _all_moduli(unit: Unit, factor: float) -> tuple[Unit, str]:
    m = unit.material
    scaled = attrs.evolve(
        m,
        lattice_modulus_kPa=m.lattice_modulus_kPa * factor,
        membrane_modulus_kPa=m.membrane_modulus_kPa * factor,
    )
    return attrs.evolve(unit, material=scaled), f"all moduli are {factor:.4g} times as large"


def _as_printed(model: ExtendedModel) -> Put:
    values = model.values
    offset = values.get("overcure.offset_mm", 0.0)
    excess = values.get("skin_cure.excess_mm", 0.0)

    def put(unit: Unit, drawn_kPa: float) -> tuple[Unit, str]:
        if model.lattice:
            # The unit has the effects by now, beside what it had of them before.
            factor = ComputedCell(model.lattice, None, *printed(unit.print)).stiffness(unit.scale, 0.0, 0.0)
        else:
            factor = SLENDER.stiffness(unit.scale, offset, excess)
        modulus = drawn_kPa * factor
        if not math.isfinite(modulus):
            raise InputError(f"its lattice modulus would be {modulus}", "lattice_modulus_kPa", "")
        material = attrs.evolve(unit.material, lattice_modulus_kPa=modulus)
        return attrs.evolve(unit, material=material), (
            f"a block of the lattice between plates has {modulus:.4g} kPa at {unit.scale:g}x as printed, "
            f"{drawn_kPa:.4g} kPa as drawn; a printed body takes neither"
        )

    return put
