"""effective.toml: what homogenising a lattice gave, its moduli and a law for an analysis mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import attrs

from .. import __version__
from ..design.quantity import in_kPa
from ..fem.laws import Foam
from ..toml_writer import Commented, toml_text
from .elasticity import Elasticity
from .foam_fit import NAME, FoamFit

FORMAT = 1
_HEAD = "# Effective moduli of a lattice, and a law of its continuum."


def effective_text(
    fit: FoamFit,
    found: Elasticity,
    cell: Mapping[str, str | float],
    resin: Mapping[str, str | float],
    inputs: str,
) -> str:
    """The text of effective.toml, with units in keys or comments.

    cell, resin: text and numbers that describe them; inputs: text of all inputs, whose hash the provenance
    keeps.
    """
    low, high = fit.stretch
    law = dict(zip(Foam.parameter_names, fit.parameters.tolist(), strict=True))
    tables = {
        "cell": ("The lattice's cell; lengths in mm.", cell),
        "resin": ("Solid material of the struts.", resin),
        "moduli": (
            "Stiffness of cubic symmetry at small strain.",
            {
                "relative_density": found.relative_density,
                **{f"{name}_kPa": in_kPa(getattr(found, name)) for name in ("C11", "C12", "C44")},
            },
        ),
        "law": (
            "Foam, cubic shear (G) and diagonal stretch (C), in parallel.",
            {"name": NAME, **law, "G_MPa": fit.shear_MPa, "C_MPa": fit.diagonal_MPa},
        ),
        "fit": (
            "Range of stretch of the fit; misfits: root mean square over the largest value on that side.",
            {"stretch_low": low, "stretch_high": high}
            | {f"misfit_{side}": value for side, value in attrs.asdict(fit.misfit).items()},
        ),
        "derived": (
            "Derived from the tables above for the reader; not read back.",
            {
                **{f"{name}_kPa": in_kPa(getattr(found, name)) for name in ("E100", "E110", "E111")},
                "nu100": found.nu100,
                "anisotropy": found.zener,
                "stable_shear": fit.stable_shear,
                "stable_pressed": fit.stable_pressed,
            },
        ),
        "provenance": (
            "Program and inputs that made this file.",
            {
                "software": "mu_addon",
                "version": __version__,
                "inputs_sha256": hashlib.sha256(inputs.encode()).hexdigest(),
            },
        ),
    }
    noted = {name: Commented(rows, (comment,)) for name, (comment, rows) in tables.items()}
    return toml_text({"format": FORMAT, **noted}, _HEAD)
