"""docs/engineering/security.md says what the code does: its limits, who reads files, what is never called."""

import ast
import importlib
import re
from pathlib import Path

import pytest

from .sources import SOURCES, nodes

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "engineering" / "security.md").read_text(encoding="utf-8")
LIMITS = re.findall(r"^\| (\d+)[^|]*\|[^|]+\| `(mu_addon[\w.]*)\.(\w+)` \|$", PAGE, re.MULTILINE)

# Who reads without a limit, and why that is no file from elsewhere.
UNLIMITED = {
    "mu_addon/reading.py": "sets the limits",
    "mu_addon/run/heartbeat.py": "what the worker it watches says, over a pipe",
    "mu_addon/blender/printing/panel.py": "a property of the scene",
    "mu_addon/blender/unit/resins.py": "a property of the unit",
    "mu_addon/blender/shared/operators.py": "a text that the user opens in Blender",
    "mu_addon/measured/table.py": "the text of a file read within its limit",
    "mu_addon/report/html_parts.py": "a part of the program",
    "mu_addon/report/pc2.py": "written the moment before",
    "mu_addon/run/child.py": "messages of a process of its own",
    "mu_addon/run/lock.py": "1000 bytes",
    "mu_addon/sensing/framing.py": "a frame, see its limit",
    "mu_addon/sensing/text_lines.py": "a line, see its limit",
    "mu_addon/sensing/recording.py": "a line of a file read within its limit",
    "mu_addon/sensing/watch.py": "a status read within the limit of a text",
}
READING = {
    "read_text",
    "read_bytes",
    "json.load",
    "json.loads",
    "tomllib.load",
    "tomllib.loads",
    "numpy.load",
}
READING |= {"np.load", "np.fromfile", "np.loadtxt", "np.genfromtxt"}
LIMITED = {"file_bytes", "file_text", "require_readable", "read_npz"}
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "os.system", "os.popen", "ctypes.CDLL"}
FORBIDDEN_MODULES = {"pickle", "marshal", "shelve", "yaml", "dill", "urllib", "http", "requests", "ftplib"}
FORBIDDEN_MODULES |= {"smtplib", "asyncio", "ssl", "xmlrpc", "socketserver"}
STARTING_PROCESSES = {
    "subprocess": {"mu_addon/run/child.py"},
    # The latter ends children with their parent.
    "multiprocessing": {"mu_addon/run/pool.py", "mu_addon/run/processes.py"},
    # The name of the machine.
    "socket": {"mu_addon/run/lock.py"},
}


def name_of(node):
    """A function's name as it is called, "json.loads" or "read_text"."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        return f"{node.value.id}.{node.attr}" if isinstance(node.value, ast.Name) else node.attr
    return ""


def calls(path):
    for node in nodes(path):
        if isinstance(node, ast.Call):
            yield name_of(node.func), node


def imported(path):
    for node in nodes(path):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield (node.module or "").split(".")[0]


def place(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize(("limit", "module", "name"), LIMITS, ids=lambda part: str(part))
def test_a_limit_is_that_of_the_code(limit, module, name):
    assert getattr(importlib.import_module(module), name) == int(limit)


def test_every_limit_of_a_reader_is_on_the_page():
    """What a reader is given as its limit is a constant of its module, and a row of the table."""
    listed, missing = {(module, name) for _, module, name in LIMITS}, []
    assert len(listed) > 15
    for path in SOURCES:
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for name, call in calls(path):
            if name not in LIMITED:
                continue
            for given in [*call.args[1:2], *(k.value for k in call.keywords if k.arg.startswith("most"))]:
                known = isinstance(given, ast.Name) and (
                    given.id == "most" or (module, given.id) in listed or given.id in {n for _, n in listed}
                )
                if not known:
                    missing.append(f"{place(path)}:{call.lineno}: {ast.unparse(given)}")
    assert missing == []


def test_whoever_reads_files_has_a_limit():
    found = {
        place(path)
        for path in SOURCES
        for name, _ in calls(path)
        if name in READING or name.rpartition(".")[2] in ("read_text", "read_bytes")
    }
    # `read_npz` checks an archive before numpy opens it.
    assert found - {"mu_addon/files.py"} == set(UNLIMITED)


def test_nothing_of_a_file_is_run():
    found = [
        f"{place(path)}:{call.lineno}: {name}"
        for path in SOURCES
        for name, call in calls(path)
        if name in FORBIDDEN_CALLS
        or any(k.arg == "shell" for k in call.keywords)
        or (
            name == "np.load"
            and not any(k.arg == "allow_pickle" and not k.value.value for k in call.keywords)
        )
    ]
    assert found == []


def test_no_module_connects_or_unpickles():
    assert [f"{place(p)}: {m}" for p in SOURCES for m in imported(p) if m in FORBIDDEN_MODULES] == []


@pytest.mark.parametrize("module", STARTING_PROCESSES)
def test_processes_are_started_where_the_page_says(module):
    assert {place(path) for path in SOURCES if module in imported(path)} == STARTING_PROCESSES[module]
