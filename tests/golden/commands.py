"""The commands whose results are recorded: a name, the words of the command line, what is written before.

Each runs in one folder for all, beside links to `assets` and `tests`, and writes into out/NAME. One entry
more is one command more: `python tests/golden/record.py NAME` writes its file into recorded/.
"""

import itertools
import json
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tests.lab_files import exports

ROOT = Path(__file__).resolve().parents[2]
RTOL = 1e-6


class Command(NamedTuple):
    words: str
    """What follows run.py, without --out; {NAME} is the folder out/NAME, and NAME runs before."""
    files: Mapping[str, str] = MappingProxyType({})
    """Path -> text of inputs that only this command has."""
    folder: str = ""
    """Folder of the results where the command has no --out."""
    status: int = 0
    rtol: float = RTOL
    """Relative error allowed to its numbers: what another order of the same sums changes at most."""
    timed: bool = False
    """Whether what it records depends on the clock: of its tables the columns are kept, and no number."""


def preset(name="mu-0.75x", **values):
    """A preset's file, three chambers, with other values."""
    text = (ROOT / "assets" / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    for key, value in {"count": 3, "name": '"small"', **values}.items():
        text = re.sub(rf"(?m)^{key} = .*", f"{key} = {value}", text)
    return text


MARKERS = [
    f'[[marker]]\nname = "{name}"\npixel = [{x}, {y}]\n'
    + (f"place_mm = [{(x - 200) * 0.3}, 0]\n" if y == 40 else "")
    for name, x, y in (("a", 150, 40), ("b", 250, 40), ("c", 150, 240), ("d", 250, 240))
]


def example(path, **values):
    """A file of `assets` with other values of single keys."""
    text = (ROOT / "assets" / path).read_text(encoding="utf-8")
    for key, value in values.items():
        text = re.sub(rf"(?m)^{key} = .*", f"{key} = {value}" if value else 'unit = "unit.toml"', text)
    return text


def angle(t):
    return 25 - 25 * np.cos(2 * np.pi * t / 10)


def recording(folder):
    """Files of a sensor's recording: three sweeps of 10 s, whose angles are in ANGLES."""
    rng, t = np.random.default_rng(0), np.arange(0, 30, 0.1)
    light = 2.4 * np.exp(-0.006 * angle(t)) + 0.05 + 0.004 * rng.normal(size=len(t))
    columns = ["time_s", "device_s", "sequence", "light_V", "dark_V"]
    rows = [f"{x:.1f},{x:.1f},{k},{v:.5f},0.05" for k, (x, v) in enumerate(zip(t, light, strict=True))]
    index = [
        {"type": "recording", "version": 1, "source": "simulated", "baud": 115200},
        {"type": "file", "file": "recording-000.csv", "columns": columns},
    ]
    return {
        f"{folder}/recording-000.csv": "\n".join([",".join(columns), *rows]) + "\n",
        f"{folder}/index.ndjson": "".join(json.dumps(line) + "\n" for line in index),
    }


def tracked():
    """Pixels of four markers, two of a base and two of a tip that turns by 3 degrees a frame."""
    rows = ["a right_px,a down_px,b right_px,b down_px,c right_px,c down_px,d right_px,d down_px"]
    for k in range(12):
        turn = np.radians(3.0 * k)
        ends = [(200 + s * 50 * np.cos(turn) + 40 * turn, 240 + s * 50 * np.sin(turn)) for s in (-1, 1)]
        rows.append(",".join(f"{x:.4f}" for x in (150, 40, 250, 40, *ends[0], *ends[1])))
    return "\n".join(rows) + "\n"


def measured(*experiments, **tables):
    """Files of a folder of measured data: (name, kind, keys) each with its table."""
    lines = [
        f'[[experiment]]\nname = "{n}"\nkind = "{kind}"\nfile = "{n}.csv"\n{keys}'
        for n, kind, keys in experiments
    ]
    return {"experiments.toml": "\n".join(lines)} | {f"{n}.csv": text for n, text in tables.items()}


def blocks():
    """Blocks of lattice at three scales, every surface cured 0.09 mm too far out, pressed and weighed."""
    seen = {0.75: (21.81458, 4.481417), 1.0: (18.82559, 9.937384), 1.5: (16.35852, 31.107982)}
    keys = 'role = "fit"\nscale = {0}\nspecimen = "{0}"\nsection_mm = [{1}, {1}]\nlength_mm = {1}\n'
    keys += "mass_g = {2}\nmass_sd_g = {3}\n"
    named = [
        (f"block-{x}", "lattice_compression", keys.format(x, 37.5 * x, mass, 0.005 * mass))
        for x, (_, mass) in seen.items()
    ]
    rows = {
        x: [f"{e},{m * e:.6f},{0.01 * m * e:.6f}" for e in (0, 0.1, 0.2, 0.3)] for x, (m, _) in seen.items()
    }
    return measured(
        *named,
        **{f"block-{x}": "\n".join(["strain,stress_kPa,stress_sd_kPa", *r]) + "\n" for x, r in rows.items()},
    )


def box(low, high):
    """The text of an OBJ file of a box."""
    corners = list(itertools.product(*zip(low, high, strict=True)))
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {face}\n" for face in faces)


def inside(folder, files):
    return {f"{folder}/{name}": text for name, text in files.items()}


ANGLES = "time_s,angle_deg\n" + "".join(f"{t:.1f},{angle(t):.4f}\n" for t in np.arange(0, 30, 0.1))
UNIT = preset()
INPUTS = {
    "unit.toml": UNIT,
    "remembers.toml": UNIT + '\n[wall]\nlaw = "prony"\nprony_g1 = 0.3\nprony_tau1_s = 2.0\n',
    "protocol.csv": "time_s,pressure_kPa\n0,0\n2,-8\n6,16\n",
    "up.csv": "time_s,pressure_kPa\n0,0\n4,12\n",
}
SMALL = "--unit unit.toml --protocol protocol.csv --refine 0.35 --times 4"
QUICK = "--unit unit.toml --protocol up.csv --refine 0.35 --times 2 --no-report"

GRIPPER = preset("gripper", unit='"finger.toml"', path='"alpha2"')
BENCH = """camera = "+x"
base = ["a", "b"]
tip = ["c", "d"]
fps = 10
ruler = ["a", "b"]
ruler_mm = 30
[experiment]
name = "turning"
"""
DESIGN = """format = 1
unit = "unit.toml"
evaluations = 3
refine = 0.3
check_refine = 0.35
seed = 0
[[target]]
kind = "angle"
pressure_kPa = 10
low = 2.5
[[target]]
kind = "mass"
objective = "minimise"
[[target]]
kind = "printable"
[[freedom]]
parameter = "chambers.wall_mm"
low = 0.7
high = 1.2
"""
CHAIN = """format = 1
protocol = "chain.csv"
tip_mass_g = 5
times = 3
mesh = { refine = 0.25 }
[joint]
pressure_step_kPa = 50.0
loaded = false
[[unit]]
file = "unit.toml"
pressure_kPa = [0, 12]
[[unit]]
file = "unit.toml"
turn_deg = 90
pressure_kPa = [0, 12]
"""
WALLS = """format = 1
name = "two walls"
[nodes.Small]
kind = "unit"
settings = { file = "../unit.toml" }
[nodes.Thick]
kind = "set_parameter"
settings = { parameter = "chambers.wall_mm", value = 1.0 }
links = { unit = ["Small.unit"] }
[nodes.Motion]
kind = "simulate"
settings = { times = 2, refine = 0.3, protocol = "../up.csv" }
links = { unit = ["Small.unit"] }
[nodes.Stiff]
kind = "simulate"
settings = { times = 2, refine = 0.3, protocol = "../up.csv" }
links = { unit = ["Thick.unit"] }
[nodes.Compare]
kind = "compare"
links = { items = ["Motion.study", "Stiff.study"] }
[nodes.Print]
kind = "check"
links = { unit = ["Thick.unit"] }
"""
COMMANDS = {
    "presets": Command("presets", folder="out"),
    "design": Command("design --unit unit.toml --path alpha1"),
    "design-body": Command(
        "design --unit unit.toml --body assets/examples/finger-in-a-body/body.obj --no-report"
    ),
    "resume": Command("resume {design}", folder="out/design"),
    "check": Command("check --unit unit.toml --path alpha1"),
    "check-file": Command("check --stl {design}/unit.stl --repair --up 0 1 0 --layers 5 10 --no-report"),
    "export": Command("export --unit unit.toml --path alpha1 --quality interactive"),
    "export-vented": Command(
        "export --unit unit.toml --vent-along 0 0 -1 --formats stl txt --quality interactive"
    ),
    "specimens": Command("specimens --unit unit.toml"),
    "simulate": Command(f"simulate {SMALL}"),
    "simulate-crossing": Command(f"simulate {QUICK} --no-self-contact"),
    "simulate-obstacle": Command(
        f"simulate {QUICK} --obstacle box.obj --friction 0.3 --orientation 90",
        {"box.obj": box((-20, 23.6, 18), (20, 30, 40))},
    ),
    "simulate-friction": Command(f"simulate {QUICK} --self-friction 0.4"),
    "simulate-memory": Command(f"simulate {QUICK.replace('unit.toml', 'remembers.toml')}"),
    "simulate-resin": Command(f"simulate {QUICK} --resin {{fit-material}}/material.toml"),
    "simulate-model": Command(f"simulate {QUICK} --model {{diagnose}}/model.toml"),
    "place": Command(f"place {SMALL} --stations 11 --workers 1 --no-report"),
    # pytetwild has no seed: each mesh of the cell is another, whose moduli differ by some per cent.
    "homogenize": Command("homogenize --unit unit.toml --friction none --refine 0.5 --no-report", rtol=0.3),
    "grip-part": Command(
        "grip --gripper gripper.toml --solid-only", {"gripper.toml": GRIPPER, "finger.toml": preset(count=4)}
    ),
    "chain": Command(
        "chain chain.toml",
        {"chain.toml": CHAIN, "chain.csv": "time_s,pressure_1_kPa,pressure_2_kPa\n0,0,0\n1,8,0\n2,8,12\n"},
    ),
    "optimize": Command("optimize design.toml --workers 1", {"design.toml": DESIGN}),
    "sweep": Command(
        "sweep sweep.toml --workers 1",
        {
            "sweep.toml": example(
                "examples/sweep/sweep.toml",
                preset=None,
                protocol='"up.csv"',
                points=2,
                times=2,
                mesh="{ refine = 0.3 }",
            )
        },
    ),
    "graph": Command("graph trees/walls.toml", {"trees/walls.toml": WALLS}),
    "graph-unit": Command("graph assets/graphs/unit.toml"),
    "fit-material": Command(
        "fit-material tests/data/treloar --laws yeoh mooney-rivlin --hold-out pure_shear"
    ),
    "import": Command(
        "import tension.csv --set kind=coupon --set mode=uniaxial", {"tension.csv": exports.TESTXPERT}
    ),
    "import-asked": Command("import tension.csv", {"tension.csv": exports.PLAIN}, status=2),
    "track": Command(
        "track pixels.csv --markers bench.toml --pressure turning.csv",
        {"pixels.csv": tracked(), "turning.csv": "time_s,pressure_kPa\n0,0\n1.1,11\n"}
        | {"bench.toml": BENCH + "".join(MARKERS)},
    ),
    "diagnose": Command("diagnose assets/examples/paper-moduli"),
    "diagnose-chamber": Command("diagnose tests/data/real/chamber_printed_fdm --no-report"),
    "diagnose-beam": Command("diagnose tests/data/measured --no-report"),
    "diagnose-blocks": Command("diagnose blocks", inside("blocks", blocks())),
    "design-experiments": Command("design-experiments tests/data/real/printed_foam --noise stress=0.5"),
    "calibrate": Command(
        "calibrate bench --channel light_V --dark dark_V --angles angles.csv",
        recording("bench") | {"angles.csv": ANGLES},
    ),
    "replay": Command(
        "replay bench --speed 0 --calibration {calibrate}/calibration.toml", recording("bench"), timed=True
    ),
    "stream": Command("stream --simulate --seconds 2", timed=True),
    "record": Command("record --simulate --seconds 2", timed=True),
}
