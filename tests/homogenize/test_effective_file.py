"""effective.toml: figures of a fit and of a tensor, and where they are from."""

import tomllib

import numpy as np
import pytest

from mu_addon.homogenize import Elasticity, effective_text
from mu_addon.homogenize.foam_fit import FoamFit, Misfit


def test_a_fit_becomes_a_file_that_says_where_it_is_from():
    row = np.array([0.006, 5.0, 0.006, 4.0, 0.0, 1.0])
    small = 0.018, 0.45, 0.056
    fit = FoamFit(row, 0.05, 0.06, (0.6, 1.4), Misfit(0.01, 0.02, 0.03), *small, *small, 0.1, 0.03)
    C = np.diag([0.072] * 3 + [0.056] * 3)
    C[:3, :3] += 0.06 * (1 - np.eye(3))
    tensor = Elasticity(C, 0.2)
    text = effective_text(fit, tensor, {"kind": "body-centred"}, {"name": "resin"}, "inputs")
    found = tomllib.loads(text)
    assert (found["cell"]["kind"], found["resin"]["name"]) == ("body-centred", "resin")
    assert list(found["moduli"].values()) == pytest.approx([0.2, 72, 60, 56])
    assert [found["law"][name] for name in ("mu_tension_MPa", "G_MPa", "C_MPa")] == [0.006, 0.05, 0.06]
    assert list(found["fit"].values()) == [0.6, 1.4, 0.01, 0.02, 0.03]
    assert found["derived"]["E111_kPa"] == pytest.approx(1e3 * tensor.E111)
    other = effective_text(fit, tensor, {}, {}, "other inputs")
    assert tomllib.loads(other)["provenance"] != found["provenance"]
