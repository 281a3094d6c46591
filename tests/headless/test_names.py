"""The version, and wrong names of commands and choices, as a newcomer meets them."""

from pathlib import Path

import pytest

import mu_addon
from mu_addon.cli import PAGES, all_commands
from mu_addon.cli.main import main

ROOT = Path(mu_addon.__file__).parents[1]


def test_one_version(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"mu_addon {mu_addon.__version__}\n"


@pytest.mark.parametrize(
    ("line", "meant"),
    [(["simulat"], "'simulate'"), (["place", "--paths", "grph", "--out", "x"], "'graph'")],
)
def test_a_wrong_name_is_told_with_the_nearest(line, meant, capsys):
    with pytest.raises(SystemExit) as ended:
        main(line)
    assert ended.value.code == 2
    assert f"did you mean {meant}?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("--refin", "did you mean '--refine'?"),
        ("--chambers", "the file of --unit sets [chambers] count"),
        ("--wall", "the file of --unit sets [chambers] wall_mm"),
        ("--colour", "has no option --colour"),
    ],
)
def test_an_option_that_a_command_lacks_is_told_with_what_may_be_meant(option, told, capsys):
    """Not taken for one that begins alike; what the unit's file sets is no option."""
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "--preset", "mu-1.0x", option, "3"])
    assert ended.value.code == 2
    words = capsys.readouterr().err
    assert told in words
    assert "`run.py simulate --help`" in words


def test_every_command_names_its_page():
    assert PAGES.keys() == all_commands().keys()
    for name, page in PAGES.items():
        assert (ROOT / "docs" / "guide" / f"{page}.md").is_file(), name
