"""`graph` as a user runs it: killed and resumed to the same digits, cached, bad files without a traceback."""

import json
import shutil
import subprocess
import time
from pathlib import Path

import pytest
import trimesh

from mu_addon.graph import Node, NodeTree, Source, tree_text
from mu_addon.nodes.definitions import definitions
from mu_addon.nodes.templates import template

from .processes import ROOT, assert_clear_failure, command, here, is_running, worker_of

PRESSED = Path(__file__).parents[1] / "data" / "pressed.csv"
# A printed body of the fewest chambers, pressed once: as cheap as it gets.
COARSE = {"refine": 0.2, "times": 2, "protocol": str(PRESSED)}
FEW = {"parameter": "chambers.count", "value": 3.0}


def two_walls():
    nodes = {
        "Whole": Node("unit", {"preset": "mu-0.75x"}),
        "Unit": Node("set_parameter", FEW, {"unit": (Source("Whole", "unit"),)}),
    }
    for wall in (0.8, 1.0):
        nodes[f"Wall {wall}"] = Node("set_parameter", {"value": wall}, {"unit": (Source("Unit", "unit"),)})
        nodes[f"Motion {wall}"] = Node("simulate", COARSE, {"unit": (Source(f"Wall {wall}", "unit"),)})
        nodes[f"Angle {wall}"] = Node("figure", links={"study": (Source(f"Motion {wall}", "study"),)})
    sources = (Source("Motion 0.8", "study"), Source("Motion 1.0", "study"))
    nodes["Compare"] = Node("compare", links={"items": sources})
    return NodeTree("two walls", nodes)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("tree") / "two.toml"
    path.write_text(tree_text(two_walls()), encoding="utf-8")
    return path


def evaluated(file, out, *more):
    done = here("graph", file, "--out", out, "--json", *more)
    assert done.returncode == 0, done.stdout + done.stderr
    messages = [json.loads(line) for line in done.stdout.splitlines()]
    shares = [message["whole"] for message in messages if "whole" in message]
    assert shares == sorted(shares), "one fraction of all nodes, which only grows"
    return messages[-1]["summary"]


@pytest.fixture(scope="module")
def whole(file, tmp_path_factory):
    out = tmp_path_factory.mktemp("graph") / "whole"
    return out, evaluated(file, out)


def states(summary):
    return {name: node["state"] for name, node in summary["nodes"].items()}


def test_a_thicker_wall_bends_less_and_the_table_says_so(whole):
    out, summary = whole
    assert set(states(summary).values()) == {"computed"}
    rows = {
        line.split(",")[0]: line.split(",")[1:]
        for line in (out / "compare-Compare.csv").read_text().splitlines()
    }
    thin, thick, more = map(float, rows["angle_highest_deg"])
    assert thin > thick > 0.0
    assert more == pytest.approx(thick - thin)
    assert float(summary["nodes"]["Angle 0.8"]["remark"]) == pytest.approx(thin, rel=1e-5)
    for wall in (0.8, 1.0):
        assert (out / summary["nodes"][f"Motion {wall}"]["folder"] / "motion.csv").is_file()
    assert "Angle minus that of Motion 0.8" in (out / "report.html").read_text()


def test_again_nothing_is_computed_and_a_changed_wall_only_its_own(whole, file, tmp_path):
    out, before = whole
    again = evaluated(file, out)
    assert {n: s for n, s in states(again).items() if n.startswith("Motion")} == {
        "Motion 0.8": "cached",
        "Motion 1.0": "cached",
    }
    assert evaluated(file, out, "--node", "Wall 0.8")["nodes"].keys() == {"Whole", "Unit", "Wall 0.8"}
    assert (out / before["nodes"]["Motion 0.8"]["folder"] / "summary.json").is_file(), "runs are kept"
    resumed = here("resume", out, "--json")
    assert resumed.returncode == 0, resumed.stdout


def test_killed_it_goes_on_to_the_same_digits_and_repeats_nothing(whole, file, tmp_path):
    reference, expected = whole
    out = tmp_path / "killed"
    process = subprocess.Popen(
        command("graph", file, "--out", out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    # Into the second of the two runs.
    while len(list(out.glob("nodes/*/cache/meshed-*"))) < 2:
        assert process.poll() is None
        time.sleep(0.005)
    worker = worker_of(out)
    process.kill()
    process.wait()
    # It ends once its input does, and has the folder until then.
    while is_running(worker):
        time.sleep(0.005)
    first = out / expected["nodes"]["Motion 0.8"]["folder"]
    written = {p.name: p.stat().st_mtime_ns for p in first.iterdir() if p.is_file()}
    assert json.loads((out / "nodes.json").read_text())["nodes"]["Motion 0.8"]["state"] == "computed"
    found = evaluated(file, out)
    assert states(found)["Motion 0.8"] == "cached"
    assert states(found)["Motion 1.0"] == "computed"
    assert {p.name: p.stat().st_mtime_ns for p in first.iterdir() if p.is_file()} == written
    assert (out / "compare-Compare.csv").read_text() == (reference / "compare-Compare.csv").read_text()
    assert [n["key"] for n in found["nodes"].values()] == [n["key"] for n in expected["nodes"].values()]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("format = 1\n[nodes.a]\nkind = 'simulate'", ["node 'a'", "not linked"]),
        ("format = 1\n[nodes.a]\nkind = 'sumulate'", ["did you mean 'simulate'"]),
        (
            "format = 1\n[nodes.a]\nkind = 'unit'\n[nodes.b]\nkind = 'place'\nlinks = {study = 'a.unit'}",
            ["node 'b'", "takes a study, not a unit", "Simulate"],
        ),
        ("format = 1\n[nodes.a]\nkind='chambers'\nlinks={profile='a.chambers'}", ["node 'a'"]),
        ("format = 1\nnodes = 1", ["nodes is not a table"]),
        ("[[[", ["not TOML"]),
        ("\0", ["not TOML"]),
        (
            "format = 1\n[nodes.u]\nkind='unit'\n[nodes.u.settings]\nfile='nowhere.toml'",
            ["nowhere.toml", "node 'u'"],
        ),
    ],
)
def test_bad_files_end_with_a_clear_message(tmp_path, text, words):
    path = tmp_path / "bad.toml"
    path.write_text(text, encoding="utf-8")
    assert_clear_failure(here("graph", path, "--out", tmp_path / "out"), 2, *words, "what to do")


def test_a_missing_file_an_unknown_node_and_a_folder_of_another_run_are_told(file, tmp_path):
    assert_clear_failure(
        here("graph", tmp_path / "no.toml", "--out", tmp_path / "o"), 2, "cannot read the graph"
    )
    assert_clear_failure(
        here("graph", file, "--out", tmp_path / "o", "--node", "X"), 2, "there is no node 'X'"
    )
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "report.html").write_text("mine")
    assert_clear_failure(here("graph", file, "--out", tmp_path / "other"), 2, "another kind of run")


def test_the_shipped_unit_is_evaluated_from_its_file(tmp_path):
    out = evaluated(ROOT / "assets" / "graphs" / "unit.toml", tmp_path / "unit")
    assert states(out) == dict.fromkeys(template("unit").nodes, "computed") | {}
    assert out["nodes"]["Trim"]["remark"].endswith("struts")


LIGHTER = """
format = 1
preset = "mu-0.75x"
evaluations = 2
refine = 0.25
check_refine = 0.3
[[target]]
kind = "mass"
objective = "minimise"
[[freedom]]
parameter = "chambers.wall_mm"
low = 0.8
high = 1.0
"""


def every_kind(wall, bench):
    """A tree with every kind of node, as coarse as each goes."""
    nodes = dict(template("unit").nodes)

    def add(name, kind, links=None, **settings):
        found = {}
        for key, texts in (links or {}).items():
            texts = [texts] if isinstance(texts, str) else texts
            found[key] = tuple(Source(*text.rsplit(".", 1)) for text in texts)
        nodes[name] = Node(kind, settings, found)

    nodes["Solid"] = Node("solid", links=nodes["Assemble Unit"].links)
    add("Whole", "unit", preset="mu-0.75x", path="alpha1")
    add("U", "set_parameter", {"unit": "Whole.unit"}, **FEW)
    add("Thick", "set_parameter", {"unit": "U.unit"}, value=1.0)
    add("Move", "simulate", {"unit": "U.unit"}, **COARSE)
    add(
        "Rank", "place", {"study": "Move.study"},
        stations=11, mesh_check=False, workers=1,
    )  # fmt: skip
    add("Map", "sensitivity", {"study": "Rank.study"})
    add("Light", "light", {"study": "Rank.study"})
    add("Angle", "figure", {"study": "Move.study"})
    add("Number", "number", value=0.05)
    add("Scaled", "calculate", {"a": "Angle.number", "b": "Number.number"}, operation="multiply")
    add("Moduli", "homogenize", {"unit": "U.unit"}, friction="none", refine=0.5)
    add("Check", "check", {"unit": "U.unit"})
    add("Export", "export", {"unit": "U.unit"}, formats="stl txt", quality="interactive")
    add("Data", "data", folder=str(ROOT / "assets" / "examples" / "paper-moduli"))
    add("Cause", "diagnose", {"data": "Data.data"})
    add("As Measured", "simulate", {"unit": "U.unit", "model": "Cause.model"}, **COARSE)
    add("Compare", "compare", {"items": ["Move.study", "As Measured.study"]})
    add("Wall", "obstacle", file=str(wall), friction=0.3)
    # A short path begins at the inlet, where the plate would cover its seat.
    add("Finger", "unit", parameters="format = 1\n[chambers]\ncount = 3\n[waveguide]\nseats = false\n")
    add("Gripper", "gripper", {"unit": "Finger.unit"}, path="alpha1")
    add("Grasp", "grip", {"gripper": "Gripper.gripper"}, coarse=True, cubes_mm="20")
    add("Thin Or Thick", "range", values="0.8 1.0")
    add("Study", "sweep", {"unit": "U.unit", "ranges": "Thin Or Thick.range"}, stages="design", workers=1)
    add(
        "Lighter", "optimize", {"unit": "U.unit", "model": "Cause.model"}, file=str(bench / "design.toml"),
    )  # fmt: skip
    add(
        "Two", "chain", {"units": "U.unit"}, copies=2, turns_deg="0 90", reach="0 -2 110", high_kPa=20.0,
        pressure_step_kPa=50.0, loaded=False, refine=0.25,
    )  # fmt: skip
    add("Heaviest", "best", {"table": "Study.table"}, figure="mass_g")
    angles = str(ROOT / "assets" / "examples" / "bench" / "angles.csv")
    add("Record", "record", simulated=True, seconds=18.0)
    add(
        "Calibrate", "calibrate", {"bending": "Record.recording"},
        channel="light_V", dark="dark_V", angles=angles,
    )  # fmt: skip
    # The simulated sensor has no gauge: its dark level stands for one.
    add(
        "Motion", "measure", {"recording": "Record.recording", "calibration": "Calibrate.calibration"},
        pressure="dark_V",
    )  # fmt: skip
    add("Kept Map", "calibration", file=str(bench / "calibration.toml"))
    add("Kept Take", "recording", folder=str(bench / "take"))
    return NodeTree("every kind", nodes)


def calibrated(folder):
    """A recording and its calibration, made before."""
    angles = ROOT / "assets" / "examples" / "bench" / "angles.csv"
    for line in (
        ("record", "--simulate", "--seconds", "18", "--out", folder / "take"),
        (
            "calibrate", folder / "take", "--channel", "light_V", "--dark", "dark_V", "--angles", angles,
            "--out", folder / "map",
        ),
    ):  # fmt: skip
        done = here(*line)
        assert done.returncode == 0, done.stdout + done.stderr
    shutil.copy(folder / "map" / "calibration.toml", folder)
    (folder / "design.toml").write_text(LIGHTER, encoding="utf-8")
    return folder


def without_runs(tree):
    """The tree without the nodes that run a job of their own or take a recording, nor what hangs on them."""
    left = {
        name: node
        for name, node in tree.nodes.items()
        if not definitions()[node.kind].runs and node.kind not in ("recording", "calibration")
    }
    while dangling := {
        name
        for name, node in left.items()
        if any(source.node not in left for sources in node.links.values() for source in sources)
    }:
        left = {name: node for name, node in left.items() if name not in dangling}
    return NodeTree(tree.name, left)


def test_every_kind_of_node_that_runs_no_job_is_computed_and_found_again(tmp_path):
    tree = without_runs(every_kind(box(tmp_path), tmp_path / "bench"))
    assert len({node.kind for node in tree.nodes.values()}) > 12
    computed_and_found_again(tmp_path, tree)


@pytest.mark.nightly("test_every_kind_of_node_that_runs_no_job_is_computed_and_found_again")
def test_every_kind_of_node_is_computed_and_found_again(tmp_path):
    tree = every_kind(box(tmp_path), calibrated(tmp_path / "bench"))
    assert {node.kind for node in tree.nodes.values()} == set(definitions())
    computed_and_found_again(tmp_path, tree)


def box(tmp_path):
    wall = tmp_path / "wall.stl"
    trimesh.creation.box((10.0, 10.0, 10.0)).export(wall)
    return wall


def computed_and_found_again(tmp_path, tree):
    (tmp_path / "every.toml").write_text(tree_text(tree), encoding="utf-8")
    first = evaluated(tmp_path / "every.toml", tmp_path / "out")
    assert set(states(first).values()) == {"computed"}
    again = evaluated(tmp_path / "every.toml", tmp_path / "out")
    assert {n for n, s in states(again).items() if s == "cached"} == {
        name for name, node in tree.nodes.items() if definitions()[node.kind].runs
    }
    for name, node in first["nodes"].items():
        assert again["nodes"][name]["key"] == node["key"]
        assert again["nodes"][name].get("remark") == node.get("remark")
