"""Lattices whose law is known, written by hand."""

from __future__ import annotations

from mu_addon.fem.laws import Foam
from mu_addon.homogenize.effective_file import Effective
from mu_addon.homogenize.foam_fit import Misfit


def body_centred(modulus_kPa=18.0, poisson=0.45, C44_kPa=60.0):
    """A lattice as stiff as the paper's along an axis, and much stiffer in shear."""
    mu, _, _, _, lame, _ = (float(p) for p in Foam.parameters(modulus_kPa / 1e3, poisson, 5.0, 4.0)[0])
    return Effective(
        cell={"kind": "body-centred", "size_mm": 12.5, "offset_xy_mm": 0.1},
        resin={"name": "Elastic 50A", "E_MPa": 2.0},
        relative_density=0.2,
        C11_kPa=1e3 * (lame + 2 * mu),
        C12_kPa=1e3 * lame,
        C44_kPa=C44_kPa,
        parameters=(mu, 5.0, mu, 4.0, 0.0, 1.0),
        shear_MPa=C44_kPa / 1e3 - mu,
        diagonal_MPa=lame,
        stretch=(0.6, 1.4),
        misfit=Misfit(0.01, 0.02, 0.03),
        provenance={"software": "mu_addon", "version": "0.1.0", "inputs_sha256": "0" * 64},
    )
