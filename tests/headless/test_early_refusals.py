"""What no run can use is refused before its folder is made: with its name, what to do, and no file left."""

import shlex

import numpy as np
import pytest

from mu_addon.design.shapes import box
from mu_addon.design.solid import printable
from mu_addon.design.surface import stl_bytes
from tests.golden.commands import recording
from tests.studies.diagnosis_data import weighed_blocks

from .processes import ROOT, assert_clear_failure, here

BENCH = 'base = ["a", "b"]\ntip = ["c", "d"]\n' + "".join(
    f'[[marker]]\nname = "{name}"\nplace_mm = {place}\n'
    for name, place in (("a", [0.0, 0.0]), ("b", [0.0, 50.0]), ("c", [90.0, 0.0]), ("d", [90.0, 50.0]))
)
PIXELS = ",".join(f"{name} right_px,{name} down_px" for name in "abcd")
FILES = {
    "note.stl": "dear colleague, the part is attached\n",
    "bench.toml": BENCH,
    "base_only.toml": BENCH.replace('tip = ["c", "d"]\n', ""),
    "p.csv": "time_s,pressure_kPa\n0,0\n1,-10\n2,0\n",
    "unnamed.csv": "time_s,x,y\n0,1,2\n1,2,3\n",
    "base.csv": "time_s,a right_px,a down_px,b right_px,b down_px\n"
    + "".join(f"{i},1,2,1,90\n" for i in range(3)),
    **{
        name: f"time_s,{PIXELS}\n" + "".join(f"{start + i},1,2,1,90,150,2,150,90\n" for i in range(3))
        for name, start in (("late.csv", 50), ("good.csv", 0))
    },
    # Units.
    "malformed.toml": 'format = 1\nname = "x"\nscale = = 2\n',
    "misspelt.toml": "format = 1\nscale = 1.0\n\n[chambers]\nwal_mm = 0.7\n",
    "thick.toml": "format = 1\n[chambers]\nwall_mm = 2.5\n",
    # Its struts fill the cell.
    "filled.toml": "format = 1\nscale = 0.2\nwaveguide.end_mm = 1\nprint.offset_xy_mm = 0.5\n",
    # Protocols.
    "word.csv": "time_s,pressure_kPa\n0,0\n1,abc\n",
    "back.csv": "time_s,pressure_kPa\n0,0\n1,5\n1,6\n",
    "unitless.csv": "time_s,pressure\n0,0\n1,5\n",
    "bar.csv": "time_s,pressure_bar\n0,0\n1,11\n",
    "nan.csv": "time_s,pressure_kPa\n0,0\n1,nan\n",
    "void.csv": "time_s,pressure_kPa\n0,0\n1,-20000\n",
    "pressed.csv": "time_s,pressure_kPa\n0,5\n1,6\n",
    "empty.csv": "",
    # Models.
    "magic.toml": 'verdict = "named"\n[effect.magic.size]\nvalue = 1.0\n',
    "factor.toml": 'verdict = "named"\n[effect.wall_thickness.factor]\nvalue = 40.0\n',
    "text.toml": "verdict = \"named\"\n[effect.overcure.offset_mm]\nvalue = 'thick'\n",
    **recording("recorded"),
}
UNIT = "--preset mu-0.75x"
TRACK = "--markers bench.toml --pressure p.csv"
RUBBER = f"fit-material {ROOT}/tests/data/treloar"
PAPER = ROOT / "assets" / "examples" / "paper-moduli"
BENT = PAPER.parent / "paper-bending" / "unknown.toml"
GRIPPER = "grip --preset gripper"
STREAM = "stream --simulate --seconds 1"

REFUSED = [
    (f"design {UNIT} --path alpha99", "no path 'alpha99'", "'alpha9'?", "where: path", "alpha1 .. alpha10"),
    ("design --unit malformed.toml", "malformed.toml", "line 3"),
    ("design --unit misspelt.toml", "line 5", "wall_mm"),
    # The largest wall, a (a + b) / (2 (R - r)) = 3.75 x 6.25 / 12.5 mm.
    ("design --unit thick.toml", "wall", "1.87", "cavity"),
    ("place --preset mu-2.0x", "mu-2.0x", "mu-1.0x"),
    ("place --presett mu-1.0x", "--help"),
    (f"place {UNIT} --times 2", "none of the 2 samples"),
    (f"design {UNIT} --body none.stl", "no body can be read from it", "STL, OBJ or PLY"),
    (f"design {UNIT} --body misspelt.toml", "the file type .toml is not supported", "STL, OBJ or PLY"),
    (f"simulate {UNIT} --obstacle none.stl", "no body can be read from it"),
    (f"simulate {UNIT} --obstacle part.stl", "it overlaps the unit by up to"),
    (f"simulate {UNIT} --obstacle part.stl --friction -1", "friction = -1 is out of bounds"),
    (f"simulate {UNIT} --friction 0.3", "after its --obstacle"),
    (f"simulate {UNIT} --resin ''", "it is empty", "where: --resin"),
    (f"simulate {UNIT} --times 1", "times"),
    (f"simulate {UNIT} --refine 0", "refine"),
    (f"simulate {UNIT} --refine nan", "refine"),
    (f"simulate {UNIT} --no-self-contact --self-friction 0.3", "friction between walls and struts"),
    (f"simulate {UNIT} --protocol none.csv", "none.csv"),
    (f"simulate {UNIT} --protocol word.csv", "word.csv", "line 3", "not a number"),
    (f"simulate {UNIT} --protocol back.csv", "back.csv", "line 4", "time does not increase"),
    (f"simulate {UNIT} --protocol unitless.csv", "unitless.csv", "pressure_kPa", "line 1", "bar, psi"),
    (f"simulate {UNIT} --protocol bar.csv", "bar.csv", "line 3", "a pressure of 1100 kPa"),
    (f"simulate {UNIT} --protocol nan.csv", "nan.csv", "line 3", "not finite"),
    (f"simulate {UNIT} --protocol void.csv", "line 3", "a pressure of -20000 kPa", "-101.325"),
    (f"simulate {UNIT} --protocol pressed.csv", "pressed.csv", "0 kPa"),
    (f"simulate {UNIT} --protocol empty.csv", "empty.csv", "empty"),
    (f"simulate {UNIT} --protocol noise.csv", "noise.csv", "not UTF-8 text"),
    (f"simulate {UNIT} --model magic.toml", "magic", "[effect] magic"),
    (f"simulate {UNIT} --model factor.toml", "wall_thickness.factor", "factor.toml"),
    (f"simulate {UNIT} --model text.toml", "effect.overcure.offset_mm", "not a number"),
    ("import none.csv", "where: none.csv", "check path and file"),
    ("import noise.csv", "where: noise.csv", "export it as CSV or text"),
    ("check --stl note.stl", "where: note.stl", "export it again"),
    ("check --stl note.stl --repair", "where: note.stl", "export it again"),
    ("check --stl part.stl --printer form-9", "no printer 'form-9'"),
    ("check --stl part.stl --path alpha4", "--path needs a unit"),
    ("check --stl part.stl --up 0 0 0", "is not a direction"),
    ("check --stl part.stl --layers -1", "layer"),
    (f"check {UNIT} --repair", "--repair"),
    (f"track none.csv {TRACK}", "where: none.csv", "give a movie"),
    (f"track unnamed.csv {TRACK}", "where: unnamed.csv", "NAME right_px"),
    (f"track late.csv {TRACK}", "where: late.csv", "give starts_s"),
    (f"track base.csv {TRACK.replace('bench', 'base_only')}", "angle_deg is missing", "base.csv"),
    (f"export {UNIT} --path alpha1 --path-row path7", "where: --path-row", "leave --path-row out"),
    (f"export {UNIT} --path-row path7", "where: --path-row", "with --path"),
    ("chain none.toml", "cannot read the chain", "where: none.toml", "give a chain.toml"),
    (f"{STREAM} --calibration none.toml", "No such file", "where: none.toml", "that `calibrate` writes"),
    (f"{STREAM} --calibration noise.toml", "not UTF-8 text", "where: noise.toml", "that `calibrate` writes"),
    ("calibrate recorded", "2 channels are available"),
    ("calibrate recorded --channel lihgt_V", "unknown channel lihgt_V"),
    ("calibrate recorded --channel light_V --dark drak_V", "unknown channel drak_V"),
    ("calibrate recorded --channel light_V", "has no reference angles"),
    ("calibrate recorded --channel light_V --angles nowhere.csv", "cannot read nowhere.csv"),
    (f"homogenize {UNIT} --cells 0", "cells = 0 is out of bounds"),
    (f"homogenize {UNIT} --strain 2", "strain = 2 is out of bounds"),
    (f"homogenize {UNIT} --refine 0.4", "refine = 0.4 is too coarse for the specimen"),
    (f"homogenize {UNIT} --resin no-such-resin", "no-such-resin"),
    ("homogenize --unit filled.toml --friction none", "offset"),
    (f"fit-material {ROOT}/tests/data/measured", "the folder contains no coupon test"),
    ("fit-material nowhere", "cannot read the experiments"),
    (f"{RUBBER} --laws gent", "unknown law 'gent'"),
    (f"{RUBBER} --hold-out planar", "there is no coupon of mode 'planar' to hold out"),
    (f"{RUBBER} --hold-out uniaxial equibiaxial pure_shear", "every coupon is held out"),
    (f"{GRIPPER} --cube 40", "does not fit"),
    (f"{GRIPPER} --friction -1", "friction = -1 is out of bounds"),
    (f"{GRIPPER} --cube 25 25", "same side"),
    ("grip --preset mu-1.0x", "not a gripper"),
    ("diagnose nowhere", "experiments.toml"),
    ("diagnose blocks", "block_1.csv", "row 3", "much"),
    (f"diagnose {PAPER} --unknown {BENT}", "no experiment bends a unit", "leave --unknown out"),
    (f"design-experiments {PAPER} --noise stress=little", "stress=little", "--noise"),
]  # fmt: skip


@pytest.fixture(scope="module")
def at(tmp_path_factory):
    """A folder with files that are not what they should be."""
    folder = tmp_path_factory.mktemp("refused")
    for name, text in FILES.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    for name in ("noise.csv", "noise.toml"):
        (folder / name).write_bytes(np.random.default_rng(1).bytes(3000))
    (folder / "part.stl").write_bytes(stl_bytes(*printable(box([0, 0, 0], [9, 9, 9]))))
    weighed_blocks(folder / "blocks", 0.0)
    (folder / "blocks" / "block_1.csv").write_text("strain,stress_kPa\n0,0\n0.1,much\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        yield folder


@pytest.mark.parametrize(("line", "words"), [(line, words) for line, *words in REFUSED])
def test_it_is_refused_at_once_and_leaves_nothing(line, words, at):
    before = sorted(at.iterdir())
    assert_clear_failure(here(*shlex.split(line), "--out", "out"), 2, *words, "what to do")
    assert sorted(at.iterdir()) == before


def test_the_clip_would_do_without_the_fault(at):
    """So that it is the fault that is refused, and not the rest of the line."""
    done = here("track", "good.csv", *TRACK.split(), "--out", "tracked")
    assert done.returncode == 0, done.stderr
    assert (at / "tracked" / "experiments.toml").exists()
