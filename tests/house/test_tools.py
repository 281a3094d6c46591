"""Which package may import which: the contracts that `.ci/lint` checks can fail, and imports are relative."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from .sources import SOURCES, nodes

ROOT = Path(__file__).resolve().parents[2]


def run(*command, cwd=ROOT):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def tool(name):
    """A console script beside this Python, whatever the PATH says."""
    return str(Path(sys.executable).with_name(name))


@pytest.mark.parametrize(
    ("module", "line", "contract"),
    [
        ("design", "from ..studies import report", "imports run downward"),
        ("novelty", "", "imports run downward"),
        ("blender/shared", "from ..unit import object", "a room of the extension imports only rooms below"),
        ("blender/novelty", "", "a room of the extension imports only rooms below"),
    ],
)
def test_the_import_contracts_can_fail(tmp_path, module, line, contract):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    rooms = "blender", "blender/shared", "blender/unit"
    for name in ("", "design", "fem", "placement", "studies", *rooms, module):
        folder = tmp_path / "mu_addon" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "__init__.py").write_text("")
    for name in ("errors.py", "files.py", "studies/report.py", "blender/unit/object.py"):
        (tmp_path / "mu_addon" / name).write_text("")
    (tmp_path / "mu_addon" / module / "new.py").write_text(line + "\n")
    status, output = run(tool("lint-imports"), "--no-cache", cwd=tmp_path)
    assert status == 1
    broken = [text for text in output.splitlines() if "BROKEN" in text]
    assert len(broken) == 1, output
    assert contract in broken[0]


def test_only_the_room_of_blender_may_know_it(tmp_path):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for room in ("fem", "blender"):
        (tmp_path / "mu_addon" / room).mkdir(parents=True)
        (tmp_path / "mu_addon" / room / "new.py").write_text("import bpy\nimport headless\n")
    _, output = run(tool("ruff"), "check", "--select", "TID251", "--output-format", "concise", cwd=tmp_path)
    found = [line for line in output.splitlines() if "TID251" in line]
    assert [line.partition(":")[0] for line in found] == ["mu_addon/fem/new.py"] * 2


def test_the_core_imports_itself_relatively():
    """In Blender the package has another name, so that an absolute import would find another copy or none."""
    absolute = []
    for path in SOURCES:
        for node in nodes(path):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module or ""]
            else:
                continue
            absolute += [f"{path}:{node.lineno}" for name in names if name.split(".")[0] == "mu_addon"]
    assert absolute == []
