"""Interface of every law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...arrays import Array
from ...design.declared_laws import wall_parameters
from .valid import require_positive


class Law:
    """A material law, never instantiated: strain energy a volume, its derivatives by F, its parameters.

    energy, stress and tangent are Warp functions of F (mat33) and m, the parameters in the order and
    units of `parameter_names`: energy in MPa, first Piola-Kirchhoff stress (mat33) and dP/dF (mat99,
    rows and columns 3 i + J). They may ask for J > 0.

    For a law with `history` > 0 numbers at a point, m continues with these numbers and the time step in s.
    Its energy is the incremental potential of the step, and `advance` (also of F and m) gives the numbers at
    the step's end. All start from 0.

    split_volume: True if W = W_iso(J^(-1/3) F) + kappa/2 (J - 1)^2, with kappa the parameter number `bulk`,
    or without the second term if `bulk` is None. whole: False for a part that only acts in parallel to
    another law; isotropic: False if directions of the body count. example: an admissible row without special
    values, at which tests compare derivatives.

    Files know a law by its name in lower case. The rest is read without running the file
    (`design.declared_laws`), so it must be literal. wall: None, or the law is offered for a unit's wall, with
    these parameters in [wall], a line each: name | default | unit | bounds | meaning | source. wall_text:
    what it does, in a few words. wall_total: names of parameters, and the most that they may add up to.
    builds_on: name of the law whose parameters in [wall] it has too. fitted: the first parameters of a row,
    which `fit-material` fits, each with its lower bound or None; stress is linear in them. terms: instead,
    the most terms of a row of pairs mu, alpha.
    """

    name: str
    parameter_names: tuple[str, ...]
    energy: Any
    stress: Any
    tangent: Any
    history = 0
    advance: Any = None
    split_volume = False
    bulk: int | None = None
    whole = True
    isotropic = True
    positive: tuple[str, ...] = ()
    from_zero: tuple[str, ...] = ()
    example: tuple[float, ...]
    wall: str | None = None
    wall_text = ""
    wall_total: tuple[Any, ...] = ()
    builds_on = ""
    fitted: tuple[tuple[str, float | None], ...] = ()
    terms = 0

    @classmethod
    def row_of_wall(cls, wall: Any, mu_MPa: float, kappa_MPa: float) -> Sequence[float]:
        """Parameters (count,) for shear and bulk modulus in MPa at small strain, and a unit's `Wall`.

        Here: shear modulus, the law's parameters in [wall] as they are, bulk modulus.
        """
        return mu_MPa, *(getattr(wall, name) for name in wall_parameters(cls.name.lower())), kappa_MPa

    @classmethod
    def wall_of_row(cls, row: Sequence[float]) -> dict[str, float]:
        """The parameters in [wall] of a row (count,), by name: those between the first and the last here."""
        return dict(zip(wall_parameters(cls.name.lower()), row[1:-1], strict=True))

    @classmethod
    def small_strain(cls, parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa at small strain of parameters (k, count).

        Of a law that depends on direction: averaged over directions (Voigt). Here: the first parameter and
        the one numbered `bulk`.
        """
        return parameters[:, [0, cls.bulk]]

    @classmethod
    def valid(cls, parameters: Array) -> None:
        """Raise InputError unless every row of parameters (k, count) is admissible.

        Here: unless the parameters named in `positive` are positive, in `from_zero` 0 or more, and finite.
        """
        require_positive(cls, parameters, *cls.positive)
        require_positive(cls, parameters, *cls.from_zero, or_zero=True)
