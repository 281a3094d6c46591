"""Effects a model may lack: mechanisms with parameters that leave the model unchanged at their null."""

from __future__ import annotations

import math
import re

import attrs

from ..errors import InputError
from .effects import DECLARED, laws_of
from .effects.declaration import Data, Law
from .parameter import OF as OF
from .parameter import Parameter as Parameter
from .parameter import factor as factor

# Another modulus of one specimen: an effect of specimens alone, see `owned`.
BATCH = "batch_variation"
# A mistyped height, a change between two tests: of some experiments alone.
GEOMETRY, STEP = "geometry_as_typed", "step_change"
# Struts printed thicker or thinner than drawn, unlike another specimen's: see `owned`.
THICKNESS = "strut_thickness"
# A factor on the force of some tests; of which causes, `scaled_by` tells.
FORCE_SCALE = "force_scale"
# A load cell off straight.
CURVED_CELL = "force_nonlinearity"
# A shift of one marker from some moment on, see `prediction.marker_slip`.
SLIP = "marker_slip"

_HYPHENED = re.compile(r"\b(rate|self)_(independent|heating)")


@attrs.frozen
class Effect:
    """Physics that the base model lacks; `kinds` are the experiments it can be seen in.

    parameters: the first is its size, whose null switches the effect off exactly; the others give its shape.
    mechanism, reveals: texts, by default of its `effects.Declaration`. whose: the one specimen or experiment
    that has it, "specimen B"; empty for all. among: owners with separate sizes, "specimen"; spread: their
    standard deviation, in the parameters' unit, with its 95 % interval. refines: a law with more freedom than
    another of its name, fitted only in its place. tried: number of alternatives among which its starts were
    chosen. Raises InputError for a name that is not declared.
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
    def _declared_mechanism(self) -> str:
        known = DECLARED.get(self.name)
        return known.mechanism if known else ""

    @reveals.default
    def _shown_by(self) -> str:
        known = DECLARED.get(self.name)
        if known is None:
            return ""
        shown = dict.fromkeys(known.shown_by.get(kind, known.reveals) for kind in self.kinds)
        return "; or ".join(shown) or known.reveals

    def __attrs_post_init__(self) -> None:
        if self.name not in DECLARED or not self.parameters:
            raise InputError(
                f"no effect {self.name!r} is known", "effect library", f"known: {', '.join(DECLARED)}"
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


def offered(data: Data) -> tuple[Effect, ...]:
    """Laws of every effect that experiments of a kind may show, bounded by them."""
    return tuple(
        _effect(name, law, data.kind)
        for name, laws in laws_of(data.kind).items()
        for template in laws
        if template is not DECLARED[name].differs
        for law in template.offered(template, data)
    )


def _effect(name: str, law: Law, kind: str) -> Effect:
    words = law.mechanism or DECLARED[name].mechanism
    found = Effect(name, law.parameters, (kind,), words, refines=law.refines, tried=law.tried)
    return attrs.evolve(found, reveals=law.reveals) if law.reveals else found


def readable(name: str) -> str:
    """An effect's or quantity's name for a reader."""
    return _HYPHENED.sub(r"\1-\2", name).replace("_", " ")


def bare(p: Parameter) -> str:
    """A parameter's name for a reader, without the unit that follows its value."""
    unit = p.unit.replace("1/", "per_").replace("/h", "_per_hour").replace("/", "_")
    name, of, whose = p.name.partition(OF)
    return readable(name.removesuffix(f"_{unit}") if unit else name) + of + whose
