"""What the checkout says about itself is true: versions, commands, pins, and nothing of anyone's machine."""

import re
import shlex
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from mu_addon import __version__
from mu_addon.cli.main import parser

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
VENV = "python3.11 -m venv .venv && .venv/bin/pip install -e "
MAIN = VENV + ". && .venv/bin/python headless/run.py simulate --preset mu-1.0x --out out/mu-1.0x"
TESTS = VENV.replace("-e", "--no-compile -e") + "'.[blender,dev]' && .venv/bin/python -m pytest"


def test_one_version():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    latest = re.search(r"^## \[(\d+\.\d+\.\d+)\]", changelog, re.MULTILINE)
    assert latest is not None
    assert PROJECT["project"]["version"] == MANIFEST["version"] == __version__ == latest[1]
    assert f"\nversion: {latest[1]}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_one_name_and_licence():
    assert PROJECT["project"]["name"] == MANIFEST["id"] == "mu_addon"
    assert MANIFEST["license"] == [f"SPDX:{PROJECT['project']['license']}"]
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "GNU GENERAL PUBLIC LICENSE" in text
    assert "Version 3, 29 June 2007" in text
    assert len(text) > 30_000


def test_every_dependency_is_pinned():
    extras = PROJECT["project"]["optional-dependencies"]
    for requirement in [*PROJECT["project"]["dependencies"], *(r for e in extras.values() for r in e)]:
        assert re.match(r"[\w.-]+==\d[\w.]*(; .+)?$", requirement), requirement


def test_the_readme_gives_both_commands():
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    assert MAIN in lines
    assert TESTS in lines


def test_ci_runs_the_readme_test_command_and_then_lint_and_types():
    script = ROOT / ".ci" / "run"
    assert script.stat().st_mode & 0o111
    lines = script.read_text(encoding="utf-8").splitlines()
    assert lines[-2:] == [TESTS, ".ci/lint"]
    assert (ROOT / ".ci" / "lint").stat().st_mode & 0o111
    assert "set -euo pipefail" in lines
    assert subprocess.run(["bash", "-n", str(script)], check=False).returncode == 0


def test_links_in_the_papers_lead_somewhere():
    own = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")]
    for page in [*own, *(ROOT / "docs").rglob("*.md")]:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if not target.startswith(("http://", "https://")):
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_picture_is_on_a_page():
    pages = "".join(
        p.read_text(encoding="utf-8") for p in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    )
    assert [p.name for p in (ROOT / "docs" / "pictures").iterdir() if f"pictures/{p.name}" not in pages] == []


def test_every_command_of_the_pages_is_one():
    """Options and their choices as the command line has them; nothing is run."""
    refused, count = [], 0
    for page in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]:
        text = page.read_text(encoding="utf-8")
        for words in re.findall(r"headless/run\.py (?:-- )?([a-z-]+ [^\n`#]*)", text):
            count += 1
            try:
                parser().parse_args(shlex.split(words))
            except SystemExit:
                refused.append(f"{page.name}: {words}")
    assert refused == []
    assert count > 30


def _kept_files():
    if shutil.which("git") is None:
        pytest.skip("no git here")
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT, capture_output=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [path for name in listed.stdout.decode().split("\0") if name and (path := ROOT / name).is_file()]


# Composed, so that this file does not name what it looks for.
_FOLDERS = "|".join(["work", "root", "farm", "home", "Users"])
_MACHINE = re.compile(
    rf"(?<![\w.~-])/(?:{_FOLDERS})/[A-Za-z.]|/tm{'p'}/[A-Za-z]+/|index-{'url'}|find-{'links'}|C:\\\\Users"
)


def test_no_file_mentions_a_machine():
    found = []
    for path in _kept_files():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            continue
        found += [
            f"{path.relative_to(ROOT)}:{i}: {line}"
            for i, line in enumerate(lines, 1)
            if _MACHINE.search(line)
        ]
    assert found == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("see " + "/ro" + "ot/x", True),
        ('"' + "/ho" + 'me/anna/mesh.vtu"', True),
        ("pip --index-" + "url x", True),
        ("homework/abc, ~/x and a/work-around", False),
    ],
)
def test_the_search_for_machines_can_find_one(text, expected):
    assert bool(_MACHINE.search(text)) == expected


def test_no_large_file():
    large = [path.name for path in _kept_files() if path.stat().st_size > 2_000_000]
    assert large == []


def test_every_module_that_a_page_names_is_there():
    """Of `folder/module.py`; what a page tells to write is of gent."""
    files, missing = {path.as_posix() for path in _kept_files()}, []
    for page in (ROOT / "docs").rglob("*.md"):
        for name in re.findall(r"`([\w/-]+/[\w-]+\.py)`", page.read_text(encoding="utf-8")):
            if not name.endswith("/gent.py") and not any(file.endswith(f"/{name}") for file in files):
                missing.append(f"{page.relative_to(ROOT)}: {name}")
    assert missing == []
