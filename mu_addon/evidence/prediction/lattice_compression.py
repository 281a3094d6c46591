"""lattice_compression: a block of lattice between plates, and its mass if it was weighed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

import attrs
import numpy as np

from ...arrays import Array
from ...homogenize.offset_response import OffsetResponse
from ...measured import Experiment
from ..effect import offered
from ..effects import Acting
from ..effects.declaration import Data
from ..load_cell import largest_N
from ..parameter import Parameter
from .specimen import NEW, recorded, specimen_setting, strain_histories

KIND = "lattice_compression"

MODULUS = Parameter("lattice_modulus_kPa", "kPa", 0.1, 1e7, 30.0, (), "at 1.0x, as drawn, along z")
DENSITY = Parameter("lattice_density_g_cm3", "g/cm3", 0.005, 2.0, 0.15, (), "as drawn")


class Scaling(Protocol):
    """Change of a lattice's modulus and mass by printing, relative to the lattice as drawn.

    scale: factor on the lengths of the design, 1 as drawn at 1.0x; offsets in mm are of the printed part and
    do not grow with it.
    """

    def stiffness(self, scale: float, offset_mm: float, excess_mm: float) -> float:
        """Modulus over the modulus as drawn.

        offset_mm: outward print offset of every surface; excess_mm: depth of the skin times (its modulus over
        the core's - 1). Both are lengths of the printed part, in mm.
        """
        ...

    def mass(self, scale: float, offset_mm: float) -> float:
        """Mass over the mass as drawn, with every surface moved outward by offset_mm."""
        ...

    def largest_offset_mm(self, scale: float) -> float:
        """Largest print offset in mm at which stiffness and mass are known."""
        ...


@attrs.frozen
class Struts:
    """Slender struts of one thickness at 1.0x: stiffness as thickness^exponent, mass as its square.

    thickness_mm: in mm, at 1.0x. exponent: 4 where struts bend, 2 where they stretch (Gibson and Ashby,
    Cellular Solids, 1997). A thin skin of depth d and modulus k times the core's adds 2 exponent (k - 1) d/t
    to the stiffness. For the lattice's cell use the computed response of `homogenize` instead, see
    `ComputedCell`.
    """

    thickness_mm: float = 1.5
    exponent: float = 4.0

    def stiffness(self, scale: float, offset_mm: float, excess_mm: float) -> float:
        """Modulus over that as drawn, ((t + 2 offset)/t)^exponent (1 + 2 exponent excess/t); mm.

        A tenth of the strut is left at least.
        """
        t = self.thickness_mm * scale
        # Exactly 1 without an effect.
        thick = max(t + 2 * offset_mm, 0.1 * t)
        return (thick / t) ** self.exponent * (1 + 2 * self.exponent * excess_mm / t)

    def mass(self, scale: float, offset_mm: float) -> float:
        """Mass over the mass as drawn, ((t + 2 offset)/t)^2; lengths in mm."""
        t = self.thickness_mm * scale
        return ((t + 2 * offset_mm) / t) ** 2

    def largest_offset_mm(self, scale: float) -> float:
        """Infinity (mm): the power law has no largest offset."""
        return math.inf


SLENDER = Struts()


@attrs.frozen
class ComputedCell:
    """Stiffness and mass of a lattice's cell, from virtual tests at several print offsets.

    To first order, a thin skin acts as additional resin of its excess modulus times its depth, so that it
    stiffens by the slope of the offset's response. reference: another block whose modulus as drawn the
    stiffness is relative to (another count of cells, for example). printed_mm, printed_excess_mm: offset and
    skin of the lattice before any effect.
    """

    response: OffsetResponse
    reference: OffsetResponse | None = None
    printed_mm: float = 0.0
    printed_excess_mm: float = 0.0

    def stiffness(self, scale: float, offset_mm: float, excess_mm: float) -> float:
        """Modulus over the reference's as drawn.

        offset_mm and excess_mm, as in `Scaling`, are added to the printed ones. Struts thinner than any that
        was computed soften by the slope at the thinnest. Raises InputError beyond the largest offset.
        """
        modulus = self.response.modulus_MPa
        drawn = (self.reference or self.response).modulus_MPa
        offset_mm, excess_mm = offset_mm + self.printed_mm, excess_mm + self.printed_excess_mm
        low, high = (bound * scale for bound in self.response.range_mm)
        at = max(offset_mm, low)
        found = float(modulus(scale, at, 1.0) / drawn(scale, 0.0, 1.0))
        if not excess_mm and at == offset_mm:
            return found
        h = 0.01 * (high - low)
        inside = min(max(at, low + h), high - h)
        slope = math.log(modulus(scale, inside + h, 1.0) / modulus(scale, inside - h, 1.0)) / (2 * h)
        return found * math.exp(slope * (offset_mm - at)) * (1 + slope * excess_mm)

    def mass(self, scale: float, offset_mm: float) -> float:
        """Mass over the mass as drawn, with offset_mm added to the printed one.

        Of struts thinner than any that was computed it falls as the square of their thickness does: the root
        is linear. Raises InputError beyond the largest offset.
        """
        density, low = self.response.relative_density, self.response.range_mm[0] * scale
        offset_mm += self.printed_mm
        at = max(offset_mm, low)
        found = float(density(scale, at) / density(1.0, 0.0))
        if at == offset_mm:
            return found
        thick, thin = math.sqrt(density(scale, 0.0)), math.sqrt(density(scale, low))
        return found * (1 + (thick - thin) / thin * (offset_mm - low) / -low) ** 2

    def largest_offset_mm(self, scale: float) -> float:
        """The last offset in mm that was computed, times `scale`, less the lattice's printed offset."""
        return self.response.range_mm[1] * scale - self.printed_mm


def _linear(strain: Array) -> Array:
    return strain


class LatticeStress:
    """Predicts compressed lattices: modulus times `curve` of the strain, and the mass of weighed specimens.

    A lattice scaled as a whole has no intrinsic length: as drawn, its modulus does not depend on scale.
    curve: stress (n,) over modulus at strain (n,), compression positive, of slope 1 at 0. experiments: in the
    order they were run, from which the earlier strain of each specimen is known. scalings: by name of the
    experiment, by default of slender struts. The mass needs columns mass_g and mass_sd_g, and section_mm and
    length_mm.
    """

    nuisances = (MODULUS, DENSITY)

    def __init__(
        self,
        experiments: Sequence[Experiment] = (),
        scalings: Mapping[str, Scaling] = MappingProxyType({}),
        curve: Callable[[Array], Array] = _linear,
    ) -> None:
        self._histories = strain_histories(experiments, KIND)
        self.scalings = scalings
        most = min(
            (self._scaling(e).largest_offset_mm(e.scale) for e in experiments if e.kind == KIND),
            default=math.inf,
        )
        data = Data(kind=KIND, experiments=experiments, largest_offset_mm=most)
        self.effects = offered(data)
        self._largest_N = largest_N(data)
        self._curve = curve

    @property
    def computed(self) -> OffsetResponse | None:
        """Response of the block whose modulus as drawn is fitted; None for slender struts."""
        found = [s for s in self.scalings.values() if isinstance(s, ComputedCell)]
        return (found[0].reference or found[0].response) if found else None

    def channels(self, experiment: Experiment) -> tuple[str, ...]:
        """Predicted columns: nominal stress in kPa, and mass in g where it and the volume are given."""
        weighed = "mass_g" in experiment.columns and _volume_cm3(experiment) is not None
        return ("stress_kPa", "mass_g") if weighed else ("stress_kPa",)

    def predict(self, experiment: Experiment, values: Mapping[str, float]) -> Array:
        """Prediction (channels, n), stress in kPa and mass in g; values as in `Simulator`.

        Raises InputError for a print offset beyond the computed ones and ConvergenceError, see `recorded`.
        """
        scaling = self._scaling(experiment)
        setting = specimen_setting(experiment, self._histories.get(experiment.name, NEW), self._largest_N)
        acting = Acting(KIND, values, setting)
        offset, excess = acting.along((0.0, 0.0), "printed")
        modulus = values.get(MODULUS.name, MODULUS.null) * scaling.stiffness(experiment.scale, offset, excess)

        def law(strain: Array) -> Array:
            setting.strain = strain
            return np.asarray(acting.along(modulus * self._curve(strain), "law"))

        found = [recorded(acting, law, values)]
        if "mass_g" in self.channels(experiment):
            mass = values.get(DENSITY.name, DENSITY.null) * (_volume_cm3(experiment) or 0.0)
            mass *= scaling.mass(experiment.scale, offset)
            found.append(np.full(len(experiment), mass))
        return np.stack(found)

    def _scaling(self, experiment: Experiment) -> Scaling:
        return self.scalings.get(experiment.name, SLENDER)


def _volume_cm3(experiment: Experiment) -> float | None:
    if experiment.section_mm is None or experiment.length_mm is None:
        return None
    return experiment.section_mm[0] * experiment.section_mm[1] * experiment.length_mm * 1e-3
