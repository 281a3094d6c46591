"""Print offsets across scales: the fit of a known lattice, and what it says of the paper's three moduli."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.offset_fit import fit_offset
from mu_addon.errors import InputError
from mu_addon.homogenize.offset_response import OffsetResponse

OFFSETS = np.linspace(-0.1, 0.4, 11)
SCALES = [0.75, 1.0, 1.5]
THICK = 1.5


def power(exponent, factor=1e-3):
    """Struts of 1.5 mm whose modulus goes with a power of their printed diameter."""
    grown = 1 + 2 * OFFSETS / THICK
    return OffsetResponse(OFFSETS, factor * grown**exponent, 0.1 * grown**2)


def test_a_scaled_lattice_without_offset_keeps_its_modulus():
    response = power(4)
    assert response.modulus_MPa(SCALES, 0.0, 2.5) == pytest.approx([2.5e-3] * 3, rel=1e-12)


@given(st.floats(-0.05, 0.15), st.floats(1.0, 5.0), st.sampled_from([2, 3, 4]))
def test_the_fit_finds_resin_and_offset(offset, resin, exponent):
    response = power(exponent)
    measured = response.modulus_MPa(SCALES, offset, resin)
    found = fit_offset(response, SCALES, measured, 0.05 * measured)
    assert found.offset_mm == pytest.approx(offset, abs=1e-5)
    assert found.resin_MPa == pytest.approx(resin, rel=1e-4)
    assert found.chi2 < 1e-6
    assert found.low95_mm < offset < found.high95_mm


def test_the_papers_moduli_ask_for_an_offset():
    """The analysis behind the design: bending struts, 0.182 mm on the diameter, 0.09 to 0.30."""
    found = fit_offset(power(4, 1.0), SCALES, [21.70, 18.34, 16.38], [0.35, 1.86, 1.21])
    assert 2 * found.offset_mm == pytest.approx(0.182, abs=0.003)
    assert 2 * found.low95_mm == pytest.approx(0.09, abs=0.01)
    assert 2 * found.high95_mm == pytest.approx(0.30, abs=0.01)
    assert found.chi2 == pytest.approx(0.08, abs=0.01)
    assert found.resin_MPa == pytest.approx(11.9, abs=0.1)


def test_a_given_resin_is_kept():
    response = power(4)
    measured = response.modulus_MPa(SCALES, 0.1, 2.5)
    found = fit_offset(response, SCALES, measured, 0.05 * measured, resin_MPa=2.5)
    assert found.resin_fixed
    assert found.offset_mm == pytest.approx(0.1, abs=1e-6)


def test_what_was_not_computed_is_refused():
    with pytest.raises(InputError, match="was not computed"):
        power(4).modulus_MPa(0.5, 0.3, 2.5)
    with pytest.raises(InputError, match="do not determine"):
        fit_offset(power(4), [1.0], [1.0], [0.1])
    with pytest.raises(InputError, match="ascending"):
        OffsetResponse([0.0, 0.1], [1.0, 2.0], [0.1, 0.1])
