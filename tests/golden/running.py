"""Runs a recorded command as a user does, and gives what is kept of it."""

import re
import shlex
import subprocess
import sys

from tests.blender.session import Blender
from tests.golden import kept
from tests.golden.commands import COMMANDS, INPUTS, ROOT

RUN = ROOT / "headless" / "run.py"
PATIENCE_S = 3600
COPIED = re.compile(r"summary.json: parameters\.|(^|/)(unit\w*|printer)\.toml: ")
"""What a unit is made of is compared once, for `design`."""
PANELS = {"out": "out", "data": "blocks", "protocol": "protocol.csv"}
OTHERS = re.compile(r"\{([\w-]+)\}")


class Workspace:
    """A folder in which commands run one after another, each once."""

    def __init__(self, folder):
        self.folder, self.done = folder.resolve(), {}
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("assets", "tests"):
            (folder / name).symlink_to(ROOT / name)
        self.write(INPUTS)

    def write(self, files):
        for name, text in files.items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")

    def run(self, name):
        """What is kept of a command: {where: value}."""
        if name not in self.done:
            own = {"help": helps, "panels": self._panels}.get(name)
            self.done[name] = own() if own else self._run(name, COMMANDS[name])
        return self.done[name]

    def _panels(self):
        """Texts of Blender's panels, without times."""
        for other in ("place", "diagnose-blocks", "check"):
            self.run(other)
        blender = Blender(sys.executable, self.folder / "blender")
        given = {name: self.folder / path for name, path in PANELS.items()}
        try:
            found = blender.call("tests.golden.panels", "texts", folder=self.folder, **given)
        finally:
            blender.close()
        return {
            where: kept.DURATION.sub("(time)", kept.DATE.sub("(date)", text.replace(str(self.folder), ".")))
            for where, text in found.items()
        }

    def _run(self, name, command):
        for other in OTHERS.findall(command.words):
            self.run(other)
        self.write(command.files)
        words = shlex.split(OTHERS.sub(r"out/\1", command.words))
        ended = run(words if command.folder else [*words, "--out", f"out/{name}"], self.folder)
        if ended.returncode != command.status:
            raise RuntimeError(f"{name} ended with {ended.returncode}:\n{ended.stdout}{ended.stderr}")
        leaves = {}
        for stream in ("stdout", "stderr"):
            lines = kept.said(getattr(ended, stream))
            if command.timed:
                lines = [kept.NUMBER.sub("#", line) for line in lines if not line.startswith("(time)")]
            leaves |= {f"{stream} {k:02d}": line for k, line in enumerate(lines)}
        folder = self.folder / (command.folder or f"out/{name}")
        if folder.name != "out":
            leaves |= dict(kept.of_folder(folder, command.timed))
        return {
            where: text.replace(str(self.folder), ".").replace(str(ROOT), ".")
            for where, text in leaves.items()
            if name == "design" or not COPIED.search(where)
        }


def run(words, folder):
    """A command line in a process of its own."""
    line = [sys.executable, str(RUN), *words]
    options = {"capture_output": True, "text": True, "timeout": PATIENCE_S, "stdin": subprocess.DEVNULL}
    return subprocess.run(line, cwd=folder, check=False, **options)


def helps():
    """Every line of every --help."""
    main = run(["--help"], ROOT).stdout
    listed = main.partition("COMMAND\n")[2].partition("options:")[0]
    names = re.findall(r"(?m)^    ([a-z][a-z-]*)(?:\s|$)", listed)
    texts = {"run.py": main} | {name: run([name, "--help"], ROOT).stdout for name in names}
    return {
        f"{name} {k:03d}": line.strip()
        for name, text in texts.items()
        for k, line in enumerate(text.splitlines())
    }
