"""Inputs of a fit of laws: coupon tests, laws, modes to hold out, weights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import attrs

from ...errors import InputError
from ...materials.coupon import Coupon
from ...materials.law_forms import FORMS, Form, form
from ...materials.settings import WEIGHTS
from ...measured import Measured, read_folder
from ...measured.folder import require_same_data
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, named_path, read_inputs, structured
from ...toml_writer import toml_text

LAYOUT = FolderLayout(
    "fit.toml",
    "# The inputs of this fit; the measured data are named by the SHA-256 of their files.",
    results=("material.toml", "fit.csv", "parameters.csv", "errors.csv", "fit_*.svg", "report.html"),
)


@attrs.frozen(eq=False)
class Job:
    """Inputs of a fit. laws: all of them without names.

    held_out_modes: modes left out of every fit, in addition to experiments with the role "held_out".
    """

    measured: Measured
    laws: tuple[str, ...] = ()
    held_out_modes: tuple[str, ...] = ()
    weights: str = WEIGHTS.field()

    def __attrs_post_init__(self) -> None:
        for name in self.laws:
            form(name)
        _coupons(self.measured, self.held_out_modes)

    @property
    def coupons(self) -> tuple[tuple[Coupon, ...], tuple[Coupon, ...]]:
        """Coupons to fit, and those held out."""
        return _coupons(self.measured, self.held_out_modes)

    @property
    def forms(self) -> list[Form]:
        """The laws to fit."""
        return [form(name) for name in dict.fromkeys(self.laws)] or list(FORMS.values())

    @property
    def data(self) -> dict[str, list[str]]:
        """Role, mode and SHA-256 of each coupon test, by name."""
        return {e.name: [e.role, str(e.mode), e.sha256] for e in self.measured.of("coupon")}

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name."""
        values = {
            "format": FORMAT,
            "laws": [f.name for f in self.forms],
            "held_out_modes": self.held_out_modes,
            "weights": self.weights,
            "data": self.data,
            "run": {"data": str(self.measured.folder.resolve())},
        }
        return {LAYOUT.inputs: toml_text(values, LAYOUT.header)}


def _coupons(
    measured: Measured, held_out_modes: Sequence[str]
) -> tuple[tuple[Coupon, ...], tuple[Coupon, ...]]:
    experiments = measured.of("coupon")
    if not experiments:
        kinds = ", ".join(dict.fromkeys(e.kind for e in measured.experiments))
        raise InputError(
            f"the folder contains no coupon test ({kinds})",
            str(measured.folder),
            'laws are fitted to experiments of kind = "coupon"',
        )
    modes = {str(e.mode) for e in experiments}
    for mode in held_out_modes:
        if mode not in modes:
            raise InputError(
                f"there is no coupon of mode {mode!r} to hold out",
                "--hold-out",
                f"modes: {', '.join(sorted(modes))}",
            )
    fitted: list[Coupon] = []
    held: list[Coupon] = []
    for e in experiments:
        away = e.role == "held_out" or e.mode in held_out_modes
        (held if away else fitted).append(Coupon.of(e))
    if not fitted:
        raise InputError("every coupon is held out", str(measured.folder), 'leave some with role = "fit"')
    return tuple(fitted), tuple(held)


def read_job(folder: Path) -> Job:
    """The job that a folder of `fit-material` describes, its data at their original path; InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    before = values.pop("data", None)
    measured = read_folder(named_path(path, run, "data", "folder of measured data"))
    job = structured(Job, values, str(path), measured=measured)
    require_same_data(measured, before, job.data)
    return job
