"""Interface of every law."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


class Law:
    """A material law, never instantiated: strain energy a volume, its derivatives by F, its parameters.

    energy, stress and tangent are Warp functions of F (mat33) and m, the parameters in the order and
    units of `parameter_names`: energy in MPa, first Piola-Kirchhoff stress (mat33) and dP/dF (mat99,
    rows and columns 3 i + J). They may ask for J > 0.

    For a law with `history` > 0 numbers at a point, m continues with these numbers and the time step in s.
    Its energy is the incremental potential of the step, and `advance` (also of F and m) gives the numbers at
    the step's end. All start from 0.

    split_volume: True if W = W_iso(J^(-1/3) F) + kappa/2 (J - 1)^2, with kappa the parameter number `bulk`,
    or without the second term if `bulk` is None.
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

    @staticmethod
    def small_strain(parameters: Array) -> Array:
        """Shear and bulk modulus (k, 2) in MPa at small strain of parameters (k, count).

        Of a law that depends on direction: averaged over directions (Voigt). Raises NotImplementedError here;
        every law defines it.
        """
        raise NotImplementedError

    @staticmethod
    def valid(parameters: Array) -> None:
        """Raise InputError unless every row of parameters (k, count) is admissible; every law defines it.

        Raises NotImplementedError here.
        """
        raise NotImplementedError
