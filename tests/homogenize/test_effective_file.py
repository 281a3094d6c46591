"""effective.toml: what is written is read, and what cannot be used is named."""

import tomllib

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError, OutputError
from mu_addon.fem.laws import CubicShear, DiagonalStretch, Foam
from mu_addon.homogenize.effective_file import (
    effective,
    parse_effective,
    read_effective,
    write_effective,
)
from mu_addon.homogenize.elasticity import Elasticity as Tensor
from mu_addon.homogenize.foam_fit import FoamFit, Misfit

from .lattice_laws import body_centred


def test_what_was_written_is_read_to_the_last_digit(tmp_path):
    found = attrs.evolve(body_centred(), C44_kPa=100 / 3, relative_density=0.1 + 0.2, stretch=(0.61, 1.37))
    write_effective(tmp_path / "effective.toml", found)
    again = read_effective(tmp_path / "effective.toml")
    assert again == found
    assert again.text() == found.text()
    assert again.law.hash() == found.law.hash()


def test_the_law_is_its_parts_in_parallel():
    law = body_centred().law
    assert [one for one, _ in law.layers] == [Foam, CubicShear, DiagonalStretch]
    assert law.stretch == (0.6, 1.4)
    alone = attrs.evolve(body_centred(), shear_MPa=0.0, diagonal_MPa=0.0).law
    assert [one for one, _ in alone.layers] == [Foam]
    other = attrs.evolve(body_centred(), shear_MPa=0.05).law
    assert len({law.hash(), alone.hash(), other.hash()}) == 3


def test_moduli_for_the_reader_are_those_of_the_tensor():
    found = body_centred(18.0, 0.45, 60.0)
    C11, C12, C44 = found.C11_kPa, found.C12_kPa, found.C44_kPa
    C = np.zeros((6, 6))
    C[:3, :3] = C12
    C[range(6), range(6)] = [C11] * 3 + [C44] * 3
    tensor = Tensor(C)
    derived = tomllib.loads(found.text())["derived"]
    assert (derived["E100_kPa"], derived["nu100"]) == pytest.approx((18.0, 0.45))
    assert derived["E110_kPa"] == pytest.approx(tensor.E110)
    assert derived["E111_kPa"] == pytest.approx(tensor.E111)
    assert derived["anisotropy"] == pytest.approx(tensor.zener)
    assert 0 < derived["stable_pressed"] < derived["stable_shear"] < 0.2


def test_a_fit_becomes_a_file_that_says_where_it_is_from():
    fit = FoamFit(
        np.array([0.006, 5.0, 0.006, 4.0, 0.0, 1.0]), 0.05, 0.06, (0.6, 1.4), Misfit(0.01, 0.02, 0.03), True,
        0.018, 0.45, 0.056, 0.018, 0.45, 0.056, 0.1, 0.03,
    )  # fmt: skip
    made = effective(fit, (0.072, 0.06, 0.056), 0.2, {"kind": "body-centred"}, {"name": "resin"}, "inputs")
    assert (made.C11_kPa, made.C12_kPa, made.C44_kPa) == pytest.approx((72, 60, 56))
    assert made.law.hash() == fit.law.hash()
    assert made.provenance["inputs_sha256"] != effective(
        fit, (0.072, 0.06, 0.056), 0.2, {"kind": "body-centred"}, {"name": "resin"}, "other inputs"
    ).provenance["inputs_sha256"]  # fmt: skip
    assert parse_effective(made.text()) == made


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[moduli]", "[modulus]", "unknown key 'modulus'; did you mean"),
        ("G_MPa = ", "H_MPa = ", "unknown key 'H_MPa'"),
        ("alpha_tension = 5.0\n", "", "alpha_tension is missing"),
        ("alpha_tension = 5.0", "alpha_tension = nan", "alpha_tension = nan is not a finite number"),
        ("alpha_tension = 5.0", "alpha_tension = 0", "alpha_tension = 0 must be other than 0"),
        ("mu_tension_MPa = 0", "mu_tension_MPa = -1", "mu_tension_MPa = -1"),
        ("G_MPa = 0", "G_MPa = -1", "G_MPa = -1"),
        ('name = "foam', 'name = "soap', "did you mean 'foam"),
        ("stretch_low = 0.6", "stretch_low = 1.2", "does not include the undeformed state"),
        ("relative_density = 0.2", "relative_density = 1.2", "relative density is 1.2"),
        ("C44_kPa = 60.0", "C44_kPa = -60.0", "C44 = -60 kPa must be positive"),
    ],
)
def test_what_cannot_be_used_is_named_with_its_place(tmp_path, old, new, message):
    text = body_centred().text()
    assert old in text
    path = tmp_path / "mine.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as caught:
        read_effective(path)
    assert "mine.toml" in caught.value.where
    assert caught.value.remedy


def test_an_unstable_law_is_named():
    """Without struts a foam of exponent -9 pulls hardest at 10^(1/9)."""
    rows = {"alpha_tension": -9.0, "C_MPa": 0.0}
    lines = body_centred().text().splitlines()
    text = "\n".join(
        f"{key} = {rows[key]}" if (key := line.split(" ")[0]) in rows else line for line in lines
    )
    with pytest.raises(InputError, match=r"unstable: its force falls from stretch 1\.29") as caught:
        parse_effective(text, "mine.toml")
    assert "mine.toml" in caught.value.where


def test_files_that_are_not_there_or_not_text_are_named(tmp_path):
    with pytest.raises(InputError, match="cannot read the lattice's law"):
        read_effective(tmp_path / "none.toml")
    (tmp_path / "picture.toml").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(InputError, match="not UTF-8"):
        read_effective(tmp_path / "picture.toml")
    with pytest.raises(OutputError):
        write_effective(tmp_path / "picture.toml" / "effective.toml", body_centred())
