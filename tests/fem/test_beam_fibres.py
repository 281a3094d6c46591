"""Beams of other laws than neo-Hooke's: closed forms, derivatives, and solid struts of the same law."""

from functools import partial

import attrs
import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.evidence import unit_body
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_run import Run, run
from mu_addon.fem.beam_fibres import Mixture, fibres_of
from mu_addon.fem.beams import Beams, frames_along, sections_of
from mu_addon.fem.laws import Foam, Layered, NeoHooke, Prony, Yeoh
from mu_addon.meshing.settings import MeshSettings

from .derivatives import assert_beams_consistent

MODULUS, POISSON, LENGTH, RADIUS = 1.2, 0.45, 2.0, 0.4
MU, KAPPA = NeoHooke.parameters(MODULUS, POISSON)[0]
COUNT = 5


def mixture(law, row, weight=1.0):
    return Mixture(law, np.tile(row, (COUNT, 1)), np.full(COUNT, weight))


def yeoh(c2_over_c1, kappa=KAPPA):
    return [mixture(Yeoh, [MU / 2, c2_over_c1 * MU / 2, 0.0, kappa])]


def one_sided(tension, compression):
    row = Foam.parameters(MODULUS, POISSON, 2.0, 2.0)[0]
    row[0], row[2] = row[0] * tension, row[2] * compression
    return [mixture(Foam, row)]


def layered(in_plane):
    return [
        mixture(NeoHooke, [MU, KAPPA]),
        mixture(Layered, Layered.parameters(in_plane, 0.0, (0, 0, 1.0))[0]),
    ]


def beams_of(laws, directions=None, poisson=POISSON):
    """Even round beams of laws; directions (COUNT, 3), any by default."""
    if directions is None:
        directions = np.random.default_rng(3).normal(size=(COUNT, 3))
    chord = LENGTH * directions / np.linalg.norm(directions, axis=1)[:, None]
    area, inertia = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4
    one = [LENGTH / area, LENGTH / (2 * inertia), LENGTH / inertia, 0.0, LENGTH**3 / (12 * inertia), 0.0]
    moduli = np.full(COUNT, MODULUS), np.full(COUNT, poisson)
    length, frames = np.full(COUNT, LENGTH), frames_along(chord)
    sections = sections_of(length, np.tile(one, (COUNT, 1)), *moduli)
    return Beams(chord, frames, sections, fibres_of(laws, length, frames, sections, *moduli))


def stretched(beams, stretch):
    """Force in N (e,) along beams that are stretched without turning."""
    x = np.zeros((COUNT, 12))
    x[:, 6:9] = (stretch - 1) * beams.chord
    return np.einsum("ei,ei->e", beams.forces(x)[:, 6:9], beams.frames[:, 2])


@pytest.mark.parametrize(
    "laws", [yeoh(1.0), one_sided(1.0, 0.3), layered(0.4)], ids=["yeoh", "foam", "layers"]
)
def test_forces_are_the_slope_of_the_energy_and_stiffness_that_of_the_forces(laws):
    assert_beams_consistent(beams_of(laws), 0.1 * np.random.default_rng(1).normal(size=(COUNT, 12)))


def test_neo_hooke_needs_no_fibres_and_by_another_name_adds_nothing():
    plain = beams_of([mixture(NeoHooke, [MU, KAPPA])])
    assert plain.fibres is None
    x = 0.1 * np.random.default_rng(1).normal(size=(COUNT, 12))
    np.testing.assert_allclose(beams_of(yeoh(0.0)).forces(x), plain.forces(x), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("stretch", [0.7, 0.9, 1.1, 1.4])
def test_a_stretched_beam_has_the_uniaxial_stress_of_its_law(stretch):
    # Incompressible, as beams are: S = 2 (l - l^-2) dW/dI1.
    mu = MODULUS / 3
    rows = [mu / 2, 0.8 * mu / 2, 0.0, 1e4 * mu]
    force = stretched(beams_of([mixture(Yeoh, rows)], poisson=0.49995), stretch)
    invariant = stretch**2 + 2 / stretch - 3
    wanted = 2 * (stretch - stretch**-2) * mu / 2 * (1 + 2 * 0.8 * invariant) * np.pi * RADIUS**2
    np.testing.assert_allclose(force, wanted, rtol=2e-3)


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["compression", "tension"])
def test_a_foam_s_modulus_is_of_its_side_with_lateral_strain_of_the_other(side):
    tension, compression = 1.0, 0.25
    force = stretched(beams_of(one_sided(tension, compression)), 1 + side * 1e-5)
    mu, lame = MU, KAPPA - 2 * MU / 3
    own, across = (tension, compression) if side > 0 else (compression, tension)
    modulus = 2 * own * mu + lame - 2 * lame**2 / (2 * across * mu + 2 * lame)
    np.testing.assert_allclose(force / (side * 1e-5 * np.pi * RADIUS**2), modulus, rtol=1e-4)


def test_layers_stiffen_a_beam_by_its_direction():
    directions = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, -1], [1, 0, 1]])
    force = stretched(beams_of(layered(0.4), directions), 1 + 1e-5)
    lame = KAPPA - 2 * MU / 3
    stiffness = np.full((3, 3), lame) + np.diag(2 * MU + 0.4 * np.array([1.0, 1.0, 0.0]))
    compliance = np.linalg.inv(stiffness)
    # At 45 degrees in the plane of x and z: Layered resists shear by half of the mean of its moduli.
    shear = MU + 0.4 / 4
    slanted = (compliance[0, 0] + compliance[2, 2] + 2 * compliance[0, 2] + 1 / shear) / 4
    moduli = 1 / np.array([compliance[0, 0], compliance[1, 1], compliance[2, 2], compliance[2, 2], slanted])
    np.testing.assert_allclose(force / (1e-5 * np.pi * RADIUS**2), moduli, rtol=1e-4)


def test_a_law_with_memory_is_refused():
    row = [MU / 2, 0.0, 0.0, KAPPA, *np.tile([0.1, 1.0], (len(Prony.parameter_names) - 4) // 2)]
    with pytest.raises(InputError, match="memory"):
        beams_of([mixture(Prony, row)])


@pytest.mark.nightly("test_a_stretched_beam_has_the_uniaxial_stress_of_its_law")
@pytest.mark.parametrize(
    ("effect", "size"),
    [("strain_stiffening", 1.0), ("anisotropy", 1.3), ("tension_compression_asymmetry", 1.5)],
)
def test_a_unit_of_beams_changes_by_a_law_as_one_of_solid_struts_does(effect, size, monkeypatch):
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))
    changes = []
    for solid in (False, True):
        monkeypatch.setattr(unit_body, "_mesh_kept", partial(mesh_printed, solid=solid))
        body = Body(unit, MeshSettings(refine=0.6))
        plain, changed = (
            run(Run(body, (0.0, 10.0, 20.0, 30.0), effect=name, size=value)).values[0]
            for name, value in (("", 0.0), (effect, size))
        )
        changes.append((changed - plain)[1:] / plain[1:])
    # What a law changes of the angle, as a share of it.
    np.testing.assert_allclose(*changes, atol=0.015)
