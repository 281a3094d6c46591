"""Tables of TOML as what declares them: every reader refuses alike, by file, line and key."""

from typing import Literal

import attrs
import pytest

from mu_addon.design.quantity import described
from mu_addon.errors import InputError
from mu_addon.toml_reader import parsed_toml

TEXT = """format = 1
name = "ring"

[wall]
thickness_mm = 0.9
kinds = ["a", "b"]
at = [0, 1.5]
spread = { low = 1, high = 2.0 }

[[point]]
x = 1
[[point]]
x = 2.5
mode = "fast"
"""


@attrs.frozen
class Wall:
    thickness_mm: float = described("thickness_mm", 1.0, "thickness", unit="mm", low=0.1, high=10).field()
    kinds: tuple[str, ...] = ()
    at: tuple[float, float] = (0.0, 0.0)
    spread: dict[str, float] = attrs.field(factory=dict)
    count: int | None = None


@attrs.frozen
class Point:
    x: float
    mode: Literal["slow", "fast"] = "slow"


@attrs.frozen
class File:
    name: str
    wall: Wall
    point: tuple[Point, ...] = ()


def read(text):
    document = parsed_toml(text, "file.toml").of_format(1)
    keys = {key: value for key, value in document.values.items() if key not in ("format", "point")}
    return attrs.evolve(document, values=keys).made(
        File, point=tuple(table.made(Point) for table in document.tables("point"))
    )


def test_tables_become_what_declares_them():
    wall = Wall(0.9, ("a", "b"), (0.0, 1.5), {"low": 1.0, "high": 2.0})
    assert read(TEXT) == File("ring", wall, (Point(1.0), Point(2.5, "fast")))


@pytest.mark.parametrize(
    ("old", "new", "what", "where"),
    [
        ("format = 1", "", "does not say its format", "format"),
        ("format = 1", "format = 2", "format = 2 is not known", "line 1, format"),
        ("format = 1", "format = true", "format = True is not known", "line 1, format"),
        ('name = "ring"', "", "name is missing", "name"),
        ('name = "ring"', "name = 3", "name = 3 is not text", "line 2, name"),
        ("thickness_mm", "thicknes_mm", "did you mean 'thickness_mm'", "line 5, [wall] thicknes_mm"),
        ("0.9", "true", "thickness_mm = True is not a number", "line 5, [wall] thickness_mm"),
        ("0.9", '"0.9"', "is not a number", "line 5, [wall] thickness_mm"),
        ("0.9", "99", "thickness_mm = 99 mm is out of bounds", "line 5, [wall] thickness_mm"),
        ('["a", "b"]', '["a", 2]', "kinds[1] = 2 is not text", "line 6, [wall] kinds[1]"),
        ("[0, 1.5]", "[0]", "at = [0] is not a list of 2 numbers", "line 7, [wall] at"),
        ("high = 2.0", "high = false", "high = False is not a number", "line 8, [wall.spread] high"),
        ("[wall]", "[wall]\ncount = 1.5", "count = 1.5 is not a whole number", "line 5, [wall] count"),
        ("[wall]", "wall = 3\n[a]", "unknown key 'a'", "line 5, a"),
        ("x = 2.5", "", "x is missing", "line 12, [point] x"),
        ('"fast"', '"quick"', "mode = 'quick'", "line 14, [point] mode"),
        ("[[point]]\nx = 1\n", "[point]\nx = 1\n", "not TOML", "line 12"),
        ("name =", "name = =", "not TOML", "line 2"),
    ],
)
def test_a_fault_is_told_by_file_line_and_key(old, new, what, where):
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        read(TEXT.replace(old, new, 1))
    assert what in caught.value.what
    assert caught.value.where == f"file.toml, {where}" or where in caught.value.where
    assert caught.value.remedy


def test_tables_by_hand_ask_for_words_numbers_and_known_keys():
    table = parsed_toml(TEXT, "file.toml").inner("wall")
    assert table.number("thickness_mm", 0.1, 10.0) == 0.9
    assert table.words("kinds", ("a", "b")) == ("a", "b")
    for ask, what in (
        (lambda: table.number("thickness_mm", 0.9, 10.0, above=True), "out of bounds"),
        (lambda: table.words("kinds", ("a",)), "kinds = 'b' is not known"),
        (lambda: table.word("none"), "none is missing"),
        (lambda: table.only(("at",), {"in [roof]": ["kinds", "thickness_mm"]}), "it belongs in [roof]"),
        (lambda: parsed_toml("a = inf", "x").number("a"), "not a finite number"),
        (lambda: parsed_toml("a = ' '", "x").word("a"), "is empty"),
        (lambda: parsed_toml("a = 1", "x").tables("a"), "not a list of tables"),
    ):
        with pytest.raises(InputError) as caught:
            ask()
        assert what in caught.value.what
