"""--quiet, which every command has, and the example that each command's --help ends with."""

import json
import shlex
import subprocess

import pytest

from mu_addon.cli import all_commands
from mu_addon.cli.main import main, parser

from .processes import command, here

SECOND = ("stream", "--simulate", "--seconds", "1", "--out")


def example_of(command, capsys):
    """The words of the command line in a command's --help, run.py left out."""
    with pytest.raises(SystemExit):
        main([command, "--help"])
    _, found = capsys.readouterr().out.split("\n\nexample: run.py ")
    return shlex.split(found)


@pytest.mark.parametrize("command", all_commands())
def test_the_example_in_its_help_is_of_the_command_and_can_be_given(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "500")
    words = example_of(command, capsys)
    assert words[0] == command
    assert not parser().parse_args(words).quiet
    assert parser().parse_args([*words, "--quiet"]).quiet


def test_quiet_leaves_the_results_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    loud = here(*SECOND, "loud")
    assert "Hz" in loud.stdout
    quiet = here(*SECOND, "out", "--quiet")
    assert quiet.returncode == 0
    assert quiet.stderr == ""
    assert "Hz" not in quiet.stdout
    assert quiet.stdout.startswith("results: out\n")
    assert len(quiet.stdout.splitlines()) == 3


def test_quiet_still_says_the_error_and_keeps_the_log(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "coupon.csv").write_text(
        "Time (s),Load (N),Extension (mm)\n" + "".join(f"{i},{i},{i / 9}\n" for i in range(20))
    )
    line = ("import", "coupon.csv", "--out", "out")
    loud, quiet = here(*line), here(*line, "--quiet")
    assert quiet.returncode == loud.returncode == 2
    assert quiet.stderr.startswith("error: the files leave open")
    assert loud.stderr.endswith(quiet.stderr)
    assert len(loud.stderr) > len(quiet.stderr)
    kinds = [json.loads(text)["type"] for text in (tmp_path / "out" / "log.ndjson").read_text().splitlines()]
    assert kinds.count("progress") > 1


def test_quiet_json_is_the_last_message(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (line,) = here(*SECOND, "out", "--quiet", "--json").stdout.splitlines()
    assert json.loads(line)["type"] == "result"


@pytest.mark.parametrize(
    ("line", "status"),
    [(("presets",), 0), (("--help",), 0), ((*SECOND, "out"), 141), ((*SECOND, "out", "--json"), 141)],
)
def test_an_output_that_nobody_reads_any_more_ends_it_quietly(tmp_path, line, status):
    """As of `| head -1`: no fault of this program, no words, and no more work."""
    ends = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "cwd": tmp_path}
    with subprocess.Popen(command(*line), **ends) as process:
        process.stdout.close()
        words = process.stderr.read().decode()
    assert words == ""
    assert process.returncode == status
    if status:
        assert "closed" in json.loads((tmp_path / "out" / "summary.json").read_text())["reason"]["what"]
