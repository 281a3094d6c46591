"""The commands in the pages of the guide: each can be given, reads what is there, and the first ones run."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from mu_addon.cli.main import parser

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "docs" / "guide").glob("*.md"))
RUN = re.compile(r"(?:\S*python|blender -b -P) headless/run\.py (?:-- )?(.*)")
# Names of options that say a file or a folder which is there already.
READ = {
    "angles", "body", "calibration", "clip", "compensate", "data", "file", "files", "folder", "gripper",
    "limits", "markers", "model", "pressure", "protocol", "recording", "stl", "unit", "wall_resin",
}  # fmt: skip
# A choice of an option that may name a file, too.
_NO_FILE = {"compensate": "unit"}
# What makes a command of a page a matter of seconds, and keeps all that it writes and reads.
QUICK_STUDY = ("--no-self-contact", "--refine", "0.2", "--times", "3")
QUICK = {
    "simulate": QUICK_STUDY,
    "place": (*QUICK_STUDY, "--stations", "11", "--no-mesh-check"),
    "grip": ("--refine", "0.25"),
    "homogenize": ("--cells", "2", "--friction", "none"),
    "design": ("--no-report",),
}
SMALL = {"mu-1.0x": "mu-0.75x"}
# The same in the files that a command reads, by the stem of their names.
QUICK_FILES = {
    "design": (
        (r"evaluations = \d+", "evaluations = 2"),
        (r"\nrefine = .*", "\nrefine = 0.3\ncheck_refine = 0.3"),
    ),
    "sweep": (
        (r"points = \d+", "points = 2"),
        (r"times = \d+", "times = 3"),
        (r"refine = 0.4", "refine = 0.3"),
    ),
    "three-walls": ((r"times = \d+", "times = 3"), (r"\nrefine = .*", "\nrefine = 0.3")),
}


def blocks(page):
    """The lines of each block of commands of a page."""
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"^ *```(\w*)\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    commands = [code for kind, code in found if not kind and "headless/run.py" in code]
    return [[line.strip() for line in code.splitlines()] for code in commands]


def words_of(line):
    """The words of a command of this program in a line of a page, or None."""
    found = RUN.fullmatch(line.split(" #")[0].strip())
    return None if found is None else shlex.split(found[1])


def named_in_words(page):
    """What a page names as code within its sentences: what the reader is told to bring stands there."""
    text = re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return {word for span in re.findall(r"`([^`]+)`", text) for word in span.split()}


def files_read(options):
    """Files and folders that a command reads, as the page spells them."""
    given = [value for name, value in vars(options).items() if name in READ and value != _NO_FILE.get(name)]
    given += [path for path, _ in getattr(options, "obstacles", [])]
    if options.command == "resume":
        given.append(options.out)
    names = [name for value in given for name in (value if isinstance(value, list) else [value])]
    return [name for name in names if name is not None]


def missing(page):
    """What commands of a page read that is neither in the repository, written before, nor told to bring."""
    written, wrong = named_in_words(page), []
    for line in [line for block in blocks(page) for line in block]:
        words = words_of(line)
        if words is None:
            written |= {shlex.split(line)[-1]} if line.startswith("cp ") else set()
            continue
        options = parser().parse_args(words)
        for name in files_read(options):
            places = {name, *map(str, Path(name).parents)} - {"."}
            if not places & written and not (ROOT / name).exists():
                wrong.append(f"{page.name}: {line}: nothing wrote {name}")
        if getattr(options, "out", None):
            written.add(options.out)
    return wrong


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_command_can_be_given_and_reads_what_is_there(page):
    assert missing(page) == []


def test_a_command_that_reads_what_nothing_wrote_is_found(tmp_path):
    page = tmp_path / "page.md"
    good = "python headless/run.py design --preset mu-1.0x --out out/a\n"
    page.write_text(f"```\n{good}python headless/run.py resume out/a\n```\n")
    assert missing(page) == []
    page.write_text(f"```\n{good}python headless/run.py resume out/b\n```\n")
    assert len(missing(page)) == 1
    page.write_text("```\npython headless/run.py design --unit mine.toml --out out/a\n```\n")
    assert len(missing(page)) == 1
    page.write_text("`mine.toml`:\n```\npython headless/run.py design --unit mine.toml --out out/a\n```\n")
    assert missing(page) == []


def quick(words):
    """A command with what makes it quick."""
    return [*(SMALL.get(word, word) for word in words), *QUICK.get(words[0], ())]


def run_block(lines, folder):
    """Run the lines of a block in a folder as a reader does, beside the files of the repository."""
    (folder / "tests").symlink_to(ROOT / "tests")
    shutil.copytree(ROOT / "assets", folder / "assets")
    for path in (folder / "assets").rglob("*.toml"):
        text = path.read_text(encoding="utf-8")
        for pattern, small in QUICK_FILES.get(path.stem, ()):
            text = re.sub(pattern, small, text)
        path.write_text(text, encoding="utf-8")
    for line in lines:
        words = words_of(line)
        if words is None:
            # Lines of other programs install this one, which is done.
            if line.startswith("cp "):
                copied, into = shlex.split(line)[1:]
                shutil.copy(folder / copied, folder / into)
            continue
        run = [sys.executable, str(ROOT / "headless" / "run.py"), *quick(words)]
        done = subprocess.run(run, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        if "--out" in words:
            assert (folder / words[words.index("--out") + 1] / "summary.json").exists(), line


BY_DAY = ("install", "parameters")
AT_NIGHT = [page.stem for page in PAGES if blocks(page) and page.stem not in BY_DAY]


@pytest.mark.slow
@pytest.mark.parametrize("stem", BY_DAY)
def test_the_first_commands_of_quick_pages_run(stem, tmp_path):
    run_block(blocks(ROOT / "docs" / "guide" / f"{stem}.md")[0], tmp_path)


@pytest.mark.nightly("test_every_command_can_be_given_and_reads_what_is_there")
@pytest.mark.parametrize("stem", AT_NIGHT)
def test_the_first_commands_of_every_other_page_run(stem, tmp_path):
    run_block(blocks(ROOT / "docs" / "guide" / f"{stem}.md")[0], tmp_path)
