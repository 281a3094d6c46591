"""A wall with a law of its own: limits of what it remembers, through a study's own job."""

import re
from pathlib import Path

import attrs
import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import (
    HIGHEST_POISSON,
    Chambers,
    Unit,
    from_toml,
    read_unit,
    to_toml,
    write_unit,
)
from mu_addon.design.wall_material import Wall
from mu_addon.errors import InputError
from mu_addon.fem.laws import Friction, Layered, NeoHooke, OgdenRoxburgh, Prony, Yeoh
from mu_addon.fem.materials import Materials
from mu_addon.fem.protocol import Protocol
from mu_addon.fem.unit_materials import materials_of
from mu_addon.materials.coupon import Coupon
from mu_addon.materials.fit import POISSON, fit_coupons
from mu_addon.materials.law_forms import FORMS
from mu_addon.materials.library import load_material, material_text, parse_material
from mu_addon.measured import read_folder
from mu_addon.meshing.settings import MeshSettings
from mu_addon.report.motion_files import read_motion
from mu_addon.simulate_and_place.motion_tables import MOTION_COLUMNS
from mu_addon.studies.unit_ranking import UnitStudy

from ..evidence.hollow_finger import finger
from . import unit_runs

ROOT = Path(__file__).parents[2]
BASE = Unit(chambers=Chambers(count=3))
MESH = MeshSettings(refine=0.2)
STAGES = ("design", "simulate")


def unit_with_wall(**values):
    return attrs.evolve(BASE, wall=Wall(**values))


def job_of(unit, time, pressure, **more):
    protocol = Protocol(np.asarray(time, float), np.asarray(pressure, float))
    return UnitStudy(unit=unit, protocol=protocol, mesh=MESH, stages=STAGES, **more)


@pytest.fixture
def hollow(monkeypatch):
    """A hollow finger in a unit's place: beams have no memory, and a solid lattice takes a minute."""

    def filled(*given, **_):
        mesh = finger(*given)
        return attrs.evolve(mesh, filled=np.ones((len(mesh.tets), 4)))

    monkeypatch.setattr("mu_addon.body.mesh_printed", filled)


def simulated(folder, job):
    """Angles (k,) in degrees of a study of motion, at the samples of its protocol."""
    work, _ = unit_runs.executed(job, folder)
    return work.results.value(("motion", None)).angle_deg, work


@pytest.fixture(scope="module")
def mesh():
    return mesh_printed(BASE, MESH)


def test_a_wall_without_a_law_of_its_own_is_what_it_always_was(mesh):
    assert "[wall]" not in to_toml(BASE)
    assert to_toml(attrs.evolve(BASE, wall=Wall(prony_g1=0.3, mullins_r=4.0))) == to_toml(BASE)
    (only,) = materials_of(BASE, mesh).layers
    assert only.law is NeoHooke
    m = BASE.material
    count = len(mesh.tets)
    expected = Materials.neo_hooke(np.full(count, m.membrane_modulus_MPa), np.full(count, m.membrane_poisson))
    assert materials_of(BASE, mesh).hash() == expected.hash()


@pytest.mark.parametrize(
    ("values", "laws"),
    [
        ({"law": "yeoh", "c2_over_c1": 0.2}, [Yeoh]),
        ({"law": "prony", "prony_g1": 0.2, "prony_g2": 0.3}, [Prony]),
        ({"law": "ogden-roxburgh"}, [OgdenRoxburgh]),
        ({"layers_excess": 0.5}, [NeoHooke, Layered]),
        ({"law": "yeoh", "layers_excess": -0.3, "friction_share": 0.5}, [Yeoh, Layered, Friction]),
    ],
)
def test_small_strain_is_the_units_moduli_under_every_law(mesh, values, laws):
    unit = unit_with_wall(**values)
    materials = materials_of(unit, mesh)
    assert [layer.law for layer in materials.layers] == laws
    E, nu = materials.small_strain(len(mesh.tets))
    if "layers_excess" not in values:
        np.testing.assert_allclose(E, unit.material.membrane_modulus_MPa, rtol=1e-12)
        np.testing.assert_allclose(nu, unit.material.membrane_poisson, rtol=1e-12)
    assert unit.wall.has_memory == any(law.history for law in laws)


def test_friction_has_its_share_of_the_shear_modulus_and_its_yield_stress(mesh):
    unit = unit_with_wall(friction_share=0.5, friction_yield_kPa=1.0)
    *_, sliding = materials_of(unit, mesh).layers
    m = unit.material
    ((mu, _),) = NeoHooke.parameters(m.membrane_modulus_MPa, m.membrane_poisson)
    np.testing.assert_allclose(sliding.parameters[0], [0.5 * mu, 1e-3])


def test_a_file_keeps_the_law_and_no_parameter_of_another(tmp_path):
    unit = unit_with_wall(law="prony", prony_g1=0.2, prony_tau1_s=3.0, friction_share=0.1)
    write_unit(unit, tmp_path / "unit.toml")
    assert read_unit(tmp_path / "unit.toml") == unit
    assert "mullins" not in to_toml(unit)
    for text, words in (
        ('[wall]\nlaw = "yeoh"\nprony_g1 = 0.2\n', r"prony_g1 has no effect with law = 'yeoh'"),
        ('[wall]\nlaw = "prony"\nprony_g1 = 0.6\nprony_g2 = 0.5\n', "add up to 1.1"),
        ('[wall]\nlaw = "prnoy"\n', "did you mean 'prony'"),
        ('[wall]\nlaw = "prony"\nprony_tau1_s = 0.0\n', "prony_tau1_s = 0 s is out of bounds"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            from_toml("format = 1\n" + text, "unit.toml")
        assert "unit.toml, line" in caught.value.where


@pytest.mark.slow
def test_a_wall_that_relaxes_is_stiff_at_once(tmp_path, hollow):
    """At once the shear modulus is 1/(1 - g) times that after long; the bulk modulus does not relax."""
    g, tau, p = 0.4, 1.0, 1.0
    # Compressible enough that no part of the bulk modulus acts on elements' mean volumes: how much of it
    # does is set by the law's long-term shear modulus.
    base = BASE.evolve(membrane_poisson=0.3)
    relaxing = attrs.evolve(base, wall=Wall(law="prony", prony_g1=g, prony_tau1_s=tau))
    # Within a millionth of tau.
    jump, study = simulated(tmp_path / "jump", job_of(relaxing, [0, 1e-6], [0, p], times=2))
    assert study.study.in_time
    mu, kappa = NeoHooke.parameters(base.material.membrane_modulus_MPa, base.material.membrane_poisson)[0]
    at_once = mu / (1 - g)
    stiff = attrs.evolve(
        base.material,
        membrane_modulus_kPa=1e3 * 9 * kappa * at_once / (3 * kappa + at_once),
        membrane_poisson=(3 * kappa - 2 * at_once) / (6 * kappa + 2 * at_once),
    )
    stiffer, _ = simulated(
        tmp_path / "stiff", job_of(attrs.evolve(base, material=stiff), [0, 1], [0, p], times=2)
    )
    assert jump[-1] == pytest.approx(stiffer[-1], rel=1e-4)
    assert jump[-1] > 0


@pytest.mark.slow
def test_a_wall_that_softens_does_not_on_its_first_loading_and_a_stopped_run_goes_on(tmp_path, hollow):
    time, pressure = [0, 1, 2, 3], [0, 1, 2, 1]
    soft, study = simulated(
        tmp_path / "soft",
        job_of(
            unit_with_wall(law="ogden-roxburgh", mullins_r=1.5, mullins_m_kPa=0.02), time, pressure, times=4
        ),
    )
    plain, _ = simulated(tmp_path / "plain", job_of(BASE, time, pressure, times=4))
    np.testing.assert_allclose(soft[:3], plain[:3], rtol=1e-6)
    assert soft[3] > 1.05 * plain[3]
    rows = (tmp_path / "soft" / "motion.csv").read_text().splitlines()
    assert rows[0] == ",".join(MOTION_COLUMNS)
    assert len(rows) == 5
    # A stop loses the last instant; what the wall remembered at the one before is there.
    max(study.results.cache.folder.glob("instant*"), key=lambda file: file.stat().st_mtime).unlink()
    again, _ = simulated(tmp_path / "soft", UnitStudy.read(tmp_path / "soft"))
    np.testing.assert_array_equal(again, soft)
    stress = np.median(read_motion(tmp_path / "soft").fields["membrane"]["von_mises_kPa"], axis=1)
    # Bent as far on its way up, the wall had more.
    assert stress[3] < 0.95 * np.interp(soft[3], soft[1:3], stress[1:3])


def test_jobs_that_know_no_such_wall_refuse_it():
    from mu_addon.design.gripper import load_gripper
    from mu_addon.evidence.unit_body import Body
    from mu_addon.fem.equilibrium import Equilibrium
    from mu_addon.fem.model import Model
    from mu_addon.fem.trajectory import simulate
    from mu_addon.simulate_and_place.named_effects import NamedEffects
    from mu_addon.studies.grip import Grip

    unit = unit_with_wall(law="prony", prony_g1=0.3)
    mesh = mesh_printed(unit, MESH)
    with pytest.raises(InputError, match="neo-Hookean wall"):
        Body(unit).materials(mesh)
    gripper = load_gripper("gripper")
    gripper = attrs.evolve(gripper, unit=attrs.evolve(gripper.unit, wall=unit.wall))
    with pytest.raises(InputError, match="a grasp does not support a wall with memory"):
        Grip(gripper=gripper)
    with pytest.raises(InputError, match="depends on its history"):
        simulate(Equilibrium(Model(mesh), materials_of(unit, mesh)), np.arange(2.0), np.array([0.0, 5.0]))
    with pytest.raises(InputError, match="wall with memory"):
        attrs.evolve(job_of(unit, [0, 1], [0, 5]), stages=("design", "simulate", "place"), paths="graph")
    stiffening = NamedEffects({"strain_stiffening": {"c2_over_c1": 0.2}})
    with pytest.raises(InputError, match="has a law of its own"):
        job_of(unit, [0, 1], [0, 5], effects=stiffening)


YEOH = """format = 1
name = "mine"
[law]
name = "Yeoh"
parameters = { c1_MPa = 0.5, c2_MPa = 0.05, c3_MPa = 0.0, kappa_MPa = 10.0 }
confidence = "fitted"
source = "my coupons"
ranges = { uniaxial = [0.8, 1.5] }
"""
RELAXING = (
    '[wall]\nlaw = "prony"\nprony_g1 = 0.25\nprony_tau1_s = 4.0\nconfidence = "fitted"\nsource = "holds"\n'
)


def test_a_resin_of_the_library_makes_a_wall():
    resin = load_material("elastic-50a-v1")
    unit = resin.in_unit(BASE)
    assert unit.wall == Wall()
    assert unit.material.membrane_modulus_kPa == pytest.approx(2700)
    mine = parse_material(YEOH + RELAXING)
    wall = mine.in_unit(BASE).wall
    assert (wall.law, wall.c2_over_c1, wall.prony_g1) == ("prony", pytest.approx(0.1), 0.25)
    assert parse_material(YEOH).in_unit(BASE).wall.law == "yeoh"
    assert parse_material(material_text(mine)).in_unit(BASE) == mine.in_unit(BASE)
    with pytest.raises(InputError, match="mullins_r has no effect") as caught:
        parse_material(YEOH + RELAXING + "mullins_r = 2.0\n", "mine.toml")
    assert "[wall] mullins_r" in caught.value.where
    ogden = YEOH.replace("Yeoh", "Mooney-Rivlin").replace(
        "c1_MPa = 0.5, c2_MPa = 0.05, c3_MPa = 0.0", "c1_MPa = 0.5, c2_MPa = 0.05"
    )
    with pytest.raises(InputError, match="cannot have the Mooney-Rivlin law"):
        parse_material(ogden).in_unit(BASE)


def fitted_text(name):
    """A material file of a law fitted to Treloar's rubber."""
    coupons = [Coupon.of(e) for e in read_folder(ROOT / "tests" / "data" / "treloar").experiments]
    fit = fit_coupons(FORMS[name], coupons)
    mine = attrs.evolve(parse_material(YEOH), law=fit.form.law, parameters=fit.parameters)
    return material_text(mine)


@pytest.mark.parametrize("name", ["neo-hooke", "yeoh"])
def test_a_law_fitted_to_coupons_goes_into_a_wall(name):
    resin = parse_material(fitted_text(name))
    unit = resin.in_unit(BASE)
    assert unit.material.membrane_poisson == POISSON
    assert unit.material.membrane_modulus_kPa == pytest.approx(1e3 * resin.modulus_MPa)
    assert from_toml(to_toml(unit)) == unit


def test_a_law_too_stiff_in_volume_is_refused_with_the_bulk_modulus_that_is_taken():
    stiff = YEOH.replace("kappa_MPa = 10.0", "kappa_MPa = 1000.0")
    with pytest.raises(InputError, match=r"wall takes 0\.499 at most") as caught:
        parse_material(stiff).in_unit(BASE)
    given = re.search(r"kappa_MPa = [\d.]+", caught.value.remedy)[0]
    unit = parse_material(YEOH.replace("kappa_MPa = 10.0", given)).in_unit(BASE)
    assert unit.material.membrane_poisson == pytest.approx(HIGHEST_POISSON, abs=2e-5)
