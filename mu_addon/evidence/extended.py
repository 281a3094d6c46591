"""The extended model: named effects, as a file that simulations accept."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import attrs

from ..errors import InputError
from ..files import write_text
from ..homogenize.offset_response import OffsetResponse
from ..reading import is_number, parse_toml, read_text
from ..toml_writer import Commented, toml_text
from .effect import SLIP, Parameter
from .effects import DECLARED
from .verdict import Verdict


@attrs.frozen
class Fitted:
    """A fitted value with its standard deviation and the ends of its 95 % interval, all in `unit`.

    An empty unit means a pure number; an unknown value is nan.
    """

    value: float
    sd: float
    low95: float
    high95: float
    unit: str = ""


@attrs.frozen
class ExtendedModel:
    """Fitted parameters of a verdict for simulations: of effects by effect and name, nuisances by name.

    verdict: kind of the verdict, one of `verdict.KINDS`. lattice: response of the printed lattice to a print
    offset, from virtual tests; None where a power law of slender struts was used. rivals: titles of effects
    that explain the data as well as these.
    """

    verdict: str
    effects: Mapping[str, Mapping[str, Fitted]]
    nuisances: Mapping[str, Fitted]
    lattice: OffsetResponse | None = None
    rivals: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Values for a simulator's `predict`: by "effect.parameter" or nuisance, each in its unit."""
        return {**{n: f.value for n, f in self.nuisances.items()}, **self.of_effects}

    @property
    def of_effects(self) -> dict[str, float]:
        """Values of the effects alone, by "effect.parameter"."""
        return {f"{e}.{p}": f.value for e, ps in self.effects.items() for p, f in ps.items()}

    def save(self, path: Path) -> None:
        """Write `text` to the file `path`; raises OutputError where that fails."""
        write_text(path, self.text())

    def text(self) -> str:
        """The text of model.toml: each value with sd, low95, high95 and unit; nan is left out."""
        effects = {
            name: Commented({p: _numbers(f) for p, f in parameters.items()}, (DECLARED[name].mechanism,))
            for name, parameters in self.effects.items()
        }
        nuisances = {name: _numbers(f) for name, f in self.nuisances.items()}
        lattice = {name: getattr(self.lattice, name) for name in _RESPONSE} if self.lattice else {}
        words = "The block that was compressed, by print offset at 1.0x: modulus over the resin's."
        values = {
            "verdict": self.verdict,
            "rivals": list(self.rivals) or None,
            "effect": effects or None,
            "nuisance": nuisances or None,
            "lattice": Commented(lattice, (words,)) if lattice else None,
        }
        return toml_text(values, "Effects named by measured data, with the accuracy of each parameter.")


def stacked(before: ExtendedModel, found: ExtendedModel) -> ExtendedModel:
    """A model joined with the results of a later diagnosis that started from it.

    A mechanism that is also found in another kind of experiment, with other parameters, keeps the earlier
    ones. Later values of nuisances, and a later response of the lattice, take the place of earlier ones.
    """
    names = dict.fromkeys((*before.effects, *found.effects))
    return ExtendedModel(
        found.verdict,
        {n: {**before.effects.get(n, {}), **found.effects.get(n, {})} for n in names},
        {**before.nuisances, **found.nuisances},
        found.lattice or before.lattice,
        found.rivals,
    )


_RESPONSE = tuple(a.name for a in attrs.fields(OffsetResponse))


def _numbers(f: Fitted) -> dict[str, float | str]:
    numbers = {"value": f.value, "sd": f.sd, "low95": f.low95, "high95": f.high95}
    return {k: v for k, v in numbers.items() if math.isfinite(v)} | {"unit": f.unit}


def extended_model(verdict: Verdict, nuisances: Iterable[Parameter] = ()) -> ExtendedModel:
    """The model of a verdict: the base with the named effects, or alone where none is named.

    nuisances: of the simulator, which give their units. Those that these data do not determine are left out.
    Intervals are the verdict's 95 % intervals, nan where it has none.
    """
    found = verdict.selection
    fit = found.chosen if verdict.names else found.base

    def fitted(key: str, unit: str = "") -> Fitted:
        low, high = verdict.intervals.get(key, (math.nan, math.nan))
        return Fitted(fit.values[key], fit.sd(key), low, high, unit)

    effects: dict[str, dict[str, Fitted]] = {}
    for e in fit.effects:
        # A slip belongs to these records: in others the marker's zero includes it.
        if not (e.whose or e.among or e.name == SLIP):
            # Two kinds of experiments may have one mechanism by parameters of their own.
            of_name = effects.setdefault(e.name, {})
            of_name |= {p.name: fitted(k, p.unit) for k, p in zip(e.keys, e.parameters, strict=True)}
    units = {p.name: p.unit for p in nuisances}
    seen = {k for k, column in zip(fit.keys, fit.jacobian.T, strict=True) if column.any()}
    known = {k: fitted(k, units.get(k, "")) for k in fit.keys if "." not in k and k in seen}
    rivals = dict.fromkeys(title for c in found.causes for title in c.rivals) if verdict.names else ()
    return ExtendedModel(verdict.kind, effects, known, rivals=tuple(rivals))


def load_model(path: Path) -> ExtendedModel:
    """Read a model.toml.

    Raises InputError if the file cannot be read, is not TOML or lacks a verdict; for a table of another type,
    an effect that is not declared, a parameter without a finite value and an unusable table [lattice].
    """
    text = read_text(path, "model", "run `diagnose` on a folder first")
    document = parse_toml(text, str(path))
    if not isinstance(document.get("verdict"), str):
        raise InputError("this is no model: it has no verdict", str(path), "give model.toml of `diagnose`")
    for table in ("effect", "nuisance", "lattice"):
        if not isinstance(document.get(table, {}), dict):
            raise InputError(f"{table} is not a table", str(path), f"write it as [{table}]")
    rivals = document.get("rivals", [])
    if not isinstance(rivals, list) or not all(isinstance(title, str) for title in rivals):
        raise InputError(
            "rivals is not a list of names", str(path), "write it as diagnose does, or leave it out"
        )
    effects = {}
    for name, parameters in document.get("effect", {}).items():
        if name not in DECLARED:
            raise InputError(f"no effect {name!r} is known", f"{path}, [effect.{name}]", ", ".join(DECLARED))
        if not isinstance(parameters, dict):
            raise InputError(f"effect.{name} is not a table", str(path), f"write [effect.{name}.PARAMETER]")
        effects[name] = {p: _fitted(path, f"effect.{name}.{p}", table) for p, table in parameters.items()}
    nuisances = {n: _fitted(path, f"nuisance.{n}", t) for n, t in document.get("nuisance", {}).items()}
    lattice = _response(path, document["lattice"]) if "lattice" in document else None
    return ExtendedModel(document["verdict"], effects, nuisances, lattice, tuple(rivals))


def _response(path: Path, table: Any) -> OffsetResponse:
    try:
        rows = [table[n] for n in _RESPONSE]
        if not all(isinstance(row, list) and all(map(is_number, row)) for row in rows):
            raise ValueError("it needs lists of numbers")
        return OffsetResponse(*rows)
    except (InputError, KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"[lattice] holds no response to a print offset: {error}",
            str(path),
            f"give {', '.join(_RESPONSE)}, or leave the table out",
        ) from error


def _fitted(path: Path, name: str, table: Any) -> Fitted:
    value = table.get("value") if isinstance(table, dict) else None
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise InputError(f"[{name}] has no value", str(path), "write value = and a number")
    others = {k: table.get(k, math.nan) for k in ("sd", "low95", "high95")}
    wrong = [k for k, v in others.items() if not is_number(v)]
    if wrong:
        raise InputError(
            f"{wrong[0]} of [{name}] is no number", str(path), f"write {wrong[0]} = and a number"
        )
    return Fitted(float(value), unit=str(table.get("unit", "")), **others)
