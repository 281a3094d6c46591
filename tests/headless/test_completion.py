"""The script that completes commands in bash, in bash itself."""

import shutil
import subprocess

import pytest

from mu_addon.cli.completion import script
from mu_addon.cli.main import main, parser

pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")


def completed(*words):
    """What bash offers for the last of some words."""
    line = " ".join(f"'{word}'" for word in words)
    asked = f'COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _mu_addon; echo "${{COMPREPLY[@]}}"'
    done = subprocess.run(
        ["bash", "--norc", "-c", script(parser()) + asked], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        (["run.py", "fit"], ["fit-material"]),
        (["python", "headless/run.py", "pl"], ["place"]),
        (["./headless/run.py", "simulate", "--prot"], ["--protocol"]),
        (["run.py", "place", "--paths", "gr"], ["graph"]),
        (["python3", "headless/run.py", "place", "--preset", "mu-1.5"], ["mu-1.5x"]),
        (["run.py", "grip", "--preset", ""], ["gripper"]),
        (["run.py", "simulate", "--unit", ""], []),
        (["python", "other.py", "simulate"], []),
    ],
)
def test_bash_completes(words, offered):
    assert completed(*words) == offered


def test_the_command_line_prints_it(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--completion", "bash"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == script(parser())
