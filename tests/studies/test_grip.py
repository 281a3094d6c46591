"""A gripper's run: its phases, a grasp with and without friction, its table of paths, its folder."""

import json
import re

import attrs
import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.design.anchors import anchor_points
from mu_addon.design.assets import asset_root
from mu_addon.design.gripper import load_gripper
from mu_addon.design.parameters import to_toml
from mu_addon.design.surface import bad_edges, stl_surface
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.fem.unit_materials import materials_of
from mu_addon.files import read_npz
from mu_addon.grasp import NAMES, Contact, Cube, Phases, grasp, read_phases, shipped_phases
from mu_addon.grasp.hand import Lift
from mu_addon.report.grasp_files import even, write_halves
from mu_addon.report.motion_files import read_motion
from mu_addon.report.pc2 import read_pc2
from mu_addon.studies.grip import Grip

from ..evidence import hollow_finger

# A hollow body as wide as its envelope stands for the fingers: what a grasp makes of them does not depend on
# their struts. Printed ones are grasped with at night.
HOLLOW = {"cells_y_plus": 1, "allow_symmetric": True, "row": 1, "seats": False, "membrane_modulus_kPa": 1e3}


def wide(unit, *settings, **_):
    """Its mesh, with a node at each anchor."""
    mesh = hollow_finger.finger(unit, *settings, half_width=1.5)
    nodes = mesh.nodes.copy()
    for anchor in anchor_points(unit):
        nodes[np.linalg.norm(nodes - anchor, axis=1).argmin()] = anchor
    return attrs.evolve(mesh, nodes=nodes)


@pytest.fixture(scope="module")
def finger():
    gripper = load_gripper("gripper")
    gripper = attrs.evolve(gripper, unit=gripper.unit.evolve(count=3, **HOLLOW), path="alpha1")
    mesh = wide(gripper.unit)
    return gripper, mesh, materials_of(gripper.unit, mesh)


def test_phases_cover_the_protocol_and_samples_meet_its_corners():
    phases = shipped_phases()
    time, pressure, names = phases.sample(0.7)
    assert tuple(dict.fromkeys(names)) == NAMES
    assert set(phases.protocol.time_s) <= set(time)
    assert (np.diff(time) <= 0.7 + 1e-12).all()
    np.testing.assert_allclose(
        pressure, np.interp(time, phases.protocol.time_s, phases.protocol.pressure_kPa)
    )
    for name in NAMES:
        start, end = phases.span(name)
        assert all((name == own) == (start < t <= end) for t, own in zip(time[1:], names[1:], strict=True))
    assert (pressure.min(), pressure.max()) == (-20.0, 40.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,pressure_kPa\n0,0\n1,10\n", "lacks the column phase"),
        ("time_s,pressure_kPa,phase\n0,0,i\n1,10,i\n2,20,iii\n", "the phases are i, iii"),
        (
            "time_s,pressure_kPa,phase\n0,0,i\n1,1,i\n2,2,ii\n3,3,iii\n4,4,iv\n5,5,v\n6,0,i\n",
            "the phases are",
        ),
    ],
)
def test_phases_out_of_order_are_refused(tmp_path, text, words):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_phases(tmp_path / "p.csv")


def test_phases_survive_their_file(tmp_path):
    (tmp_path / "p.csv").write_text(shipped_phases().text())
    assert read_phases(tmp_path / "p.csv").text() == shipped_phases().text()


def test_even_steps_keep_what_was_sampled():
    time = np.array([0.0, 1.0, 1.5, 3.0])
    values = np.arange(8.0).reshape(4, 2)
    at, found = even(time, values)
    assert np.diff(at) == pytest.approx(0.5)
    for t, row in zip(time, values, strict=True):
        assert found[np.argmin(abs(at - t))] == pytest.approx(row)


def test_a_cube_wider_than_the_gap_is_refused(finger):
    gripper, mesh, materials = finger
    with pytest.raises(InputError, match="does not fit"):
        grasp(gripper, Cube(30.0), shipped_phases(), mesh, materials)
    with pytest.raises(InputError, match="does not fit"):
        Grip(gripper=gripper, cubes_mm=(31.0,))


@pytest.fixture(scope="module")
def smooth(finger):
    """Grasps of both cubes without friction, by side."""
    gripper, mesh, materials = finger
    corners = np.array([0.0, 1.0, 6.0, 6.5, 7.0, 11.0]), np.array([0.0, -10.0, 40.0, 40.0, 40.0, 0.0])
    short = Phases(Protocol(*corners), ("i", *NAMES))
    return {
        side: grasp(gripper, Cube(side), short, mesh, materials, Contact(friction=0.0), step_s=1.0)
        for side in (29.4, 29.8)
    }


def test_without_friction_a_cycle_gives_all_work_back_and_lifts_nothing(smooth):
    """Pressure and contact are then a potential: what closing took, opening returns."""
    found = smooth[29.8]
    hold = found.end("iii")
    assert found.normal_N[hold] > 1.0
    rise = np.diff(found.volume_mm3)
    works = (found.pressure_kPa[1:] + found.pressure_kPa[:-1]) / 2e3 * rise
    assert abs(found.pressure_work_mJ) < 1e-4 * np.abs(works).sum()
    assert np.abs(found.u[-1]).max() < 1e-5
    assert found.lost_mJ[-1] == 0.0
    # A turned edge apart, a face without friction pushes square to itself.
    assert abs(found.down_N[hold]) < 0.05 * found.normal_N[hold]
    assert not found.lift.held
    assert 0 < found.deepest_mm.max() < 0.4


def test_the_smaller_cube_bends_a_finger_more_and_is_pressed_less(smooth):
    small, large = smooth[29.4], smooth[29.8]
    hold = small.end("iii")
    assert small.angle_deg[hold] > large.angle_deg[hold] + 0.1
    assert 0 < small.normal_N[hold] < large.normal_N[hold]
    # Before either is touched they are one.
    assert small.angle_deg[small.end("i")] == pytest.approx(large.angle_deg[large.end("i")], abs=1e-6)


def test_a_cubes_margin_is_of_the_largest_pull_and_by_coulombs_rule():
    lift = Lift(True, 0.1, 0.5, 2.0, 0.4, np.arange(3.0), np.array([0.2, 1.5, 1.2]))
    assert (lift.capacity_N, lift.margin, lift.margin_by_rule) == (1.5, 3.0, pytest.approx(3.2))


def test_the_printable_part_from_the_command_line(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["grip", "--preset", "gripper", "--out", str(out), "--solid-only"]) == 0
    _, triangles = stl_surface((out / "gripper.stl").read_bytes())
    assert bad_edges(triangles) == 0
    assert (out / "gripper.3mf").stat().st_size > 10_000
    assert "2 chambers" in capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert summary["size_mm"] == pytest.approx([57.5, 150.0, 81.0], abs=1e-3)
    assert "Gripper" in (out / "report.html").read_text()


def squeezed(folder, side, *more, **values):
    """Line and folder of a grasp by fingers of three chambers, which hold a lighter, smoother cube."""
    gripper = short_gripper(folder, **values)
    line = ["grip", "--gripper", str(gripper), "--out", str(folder / "out"), "--cube", side]
    line += ["--density", "0.6", "--friction", "0.3", "--coarse", "--no-self-contact"]
    line += ["--refine", "0.3", *more]
    assert main(line) == 0
    return line, folder / "out"


@pytest.mark.nightly("test_a_grasp_from_the_command_line_leaves_its_files_and_a_second_finds_it_done")
def test_a_grasp_with_friction_from_the_command_line(tmp_path):
    """Grasp, hold, lift, release: forces, energy and light, by a cube that slides."""
    _, out = squeezed(tmp_path, "25")
    summary = json.loads((out / "summary.json").read_text())
    g = summary["grasps"]["25"]
    assert g["held"]
    assert g["margin"] > 1.0
    assert g["carried_after_lift_N"] == pytest.approx(g["weight_N"], rel=0.1)
    # Sliding at the plateau: friction is at its bound, and drags the cube down.
    assert g["down_at_hold_N"] == pytest.approx(0.3 * g["normal_at_hold_N"], rel=0.05)
    # What pressure and the cube's way put in over the cycle is what friction took.
    put_in = g["pressure_work_mJ"] + g["cube_work_mJ"]
    assert put_in == pytest.approx(g["lost_to_friction_mJ"], rel=0.15)
    light = summary["light"]["25"]
    assert abs(light["lost_at_end_of"]["iii"]) > 4 * light["error_at_end_of"]["iii"]
    assert light["lost_at_end_of"]["v"] == pytest.approx(0.0, abs=1e-3)


# As short a way to a cube as there is.
SQUEEZE = "time_s,pressure_kPa,phase\n0,0,i\n0.5,0,i\n2.5,20,ii\n3,20,iii\n3.5,20,iv\n5.5,0,v\n"


@pytest.mark.slow
def test_a_grasp_from_the_command_line_leaves_its_files_and_a_second_finds_it_done(tmp_path, monkeypatch):
    monkeypatch.setattr("mu_addon.body.mesh_printed", wide)
    (tmp_path / "p.csv").write_text(SQUEEZE)
    line, out = squeezed(tmp_path, "25.8", "--protocol", str(tmp_path / "p.csv"), **HOLLOW)
    summary = json.loads((out / "summary.json").read_text())
    g = summary["grasps"]["25.8"]
    assert g["normal_at_hold_N"] > 0.01
    # Within Coulomb's bound, and more work is put in than comes back.
    assert abs(g["down_at_hold_N"]) <= 0.3 * g["normal_at_hold_N"] * (1 + 1e-3)
    assert g["lost_to_friction_mJ"] > 0
    assert set(summary["light"]) == {"25.8"}
    motion = read_motion(out / "cube-25.8")
    assert len(motion.time_s) == len(motion.state_kPa)
    whole = read_npz(out / "cube-25.8" / "gripper.npz")
    for side, rest in zip(("left", "right"), whole["rest_mm"], strict=True):
        positions, start, step = read_pc2(out / "cube-25.8" / f"{side}.pc2")
        np.testing.assert_allclose(positions[0], rest, atol=1e-3)
        assert (start, step) == (0.0, 0.5)
        assert whole["triangles"].max() < positions.shape[1]
    # Cut open, both show the half away from +x, and end where the whole ones do.
    for side, rest, half in zip(
        ("left", "right"), whole["rest_mm"], write_halves(out / "cube-25.8"), strict=True
    ):
        vertices, triangles, membrane = half
        positions, _, _ = read_pc2(out / "cube-25.8" / f"{side}-cut.pc2")
        np.testing.assert_allclose(positions[0], vertices, atol=1e-3)
        assert vertices[:, 0].max() <= 1e-9
        np.testing.assert_allclose(vertices[:, 1:].min(axis=0), rest[:, 1:].min(axis=0), atol=1e-3)
        assert len(triangles) == len(membrane)
        corners = vertices[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat = (corners[:, :, 0] == 0.0).all(axis=1)
        assert (normals[flat, 0] > 0.0).all(), "the section faces +x"
    names = {p.name for p in out.iterdir()}
    assert {"gripper.stl", "grasp_25.8.csv", "pull_25.8.csv", "report.html", "frame_25.8_iv.png"} <= names
    report = (out / "report.html").read_text()
    before = (out / "grasp_25.8.csv").read_text()
    assert "capacity / weight" in report
    monkeypatch.setattr("mu_addon.grasp.grasp", lambda *_, **__: pytest.fail("grasped again"))
    assert main([*line, "--no-report"]) == 0
    assert (out / "grasp_25.8.csv").read_text() == before


def short_gripper(folder, **values):
    """A gripper of fingers of three chambers, which reach no farther than a narrow gap, as a file."""
    (folder / "unit.toml").write_text(to_toml(load_gripper("gripper").unit.evolve(count=3, **values)))
    text = (asset_root() / "presets" / "gripper.toml").read_text().replace("gap_mm = 30.0", "gap_mm = 26.0")
    for key, value in (("unit", "unit.toml"), ("path", "alpha1")):
        text = re.sub(f"(?m)^{key} = .*", f'{key} = "{value}"', text)
    (folder / "g.toml").write_text(text)
    return folder / "g.toml"
