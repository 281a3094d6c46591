"""Texts of the core as panels have them: nothing of the command line."""

import re
from unittest.mock import MagicMock

import bpy

from mu_addon.blender.shared.panels import wrapped
from mu_addon.blender.shared.wording import in_panel
from mu_addon.blender.sidebar import menus
from mu_addon.diagnose.words import what_to_do
from mu_addon.evidence.effects import DECLARED

from .drawing import panels_of


def test_what_to_do_about_a_cause_names_buttons_and_no_options():
    for name in DECLARED:
        text = in_panel(what_to_do((name,)))
        assert "--" not in text, (name, text)
        assert ".toml" not in text, (name, text)
    assert in_panel(what_to_do(("overcure",))).startswith(
        "Apply the extended model; print with that offset (Comp"
    )


def test_no_line_of_a_panel_ends_between_a_number_and_its_unit():
    layout = MagicMock()
    for end in range(20, 40):
        wrapped(layout, f"{'x' * end} 12 % too small, by 3.5 mm in 2 structures")
    lines = [call.kwargs["text"] for call in layout.column.return_value.label.call_args_list]
    assert {"12 %", "3.5 mm", "2 structures"} <= set(re.findall(r"[\d.]+ \S[a-z]*", "\n".join(lines)))
    assert not [line for line in lines if re.search(r"\d$", line) and not line.endswith(" 2")]
    assert all("\N{NO-BREAK SPACE}" not in line for line in lines)


OF_A_ROW = re.compile(
    "(drop|import|job|node|tree|track)_|.*_(cancel|dismiss|open|list|unlist|select|port|channel|show|up)$|"
    "(again|dismiss|fit|mute|picture|track|take_asset|preset_remove|run_compare|obstacle_remove)$|"
    "optimize_(add|apply)|evidence_(motion|protocol)"
)
"""Operators on one row of a list, on what was dropped, of the status bar, or of another editor's menus."""


def test_the_menu_search_finds_every_action_on_a_unit():
    """F3 finds what is in menus."""
    layout, found = MagicMock(), set()
    for name in ("operator", "operator_menu_enum"):
        getattr(layout, name).side_effect = lambda name, *_, **__: found.add(name) or MagicMock()
    for menu in panels_of(menus):
        menu.draw(MagicMock(layout=layout), bpy.context)
    menus._add(MagicMock(layout=layout), bpy.context)
    every = {f"mu.{name}" for name in dir(bpy.ops.mu)}
    assert found <= every
    assert {name for name in every - found if not OF_A_ROW.match(name.removeprefix("mu."))} == set()
