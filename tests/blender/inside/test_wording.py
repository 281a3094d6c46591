"""Texts of the core as panels have them: nothing of the command line."""

from mu_addon.blender.shared.wording import in_panel
from mu_addon.usecases.diagnose.remedies import TO_DO, what_to_do


def test_what_to_do_about_a_cause_names_buttons_and_no_options():
    for name in TO_DO:
        text = in_panel(what_to_do((name,)))
        assert "--" not in text, (name, text)
        assert ".toml" not in text, (name, text)
    assert in_panel(what_to_do(("overcure",))).startswith(
        "Apply the extended model; print with that offset (Comp"
    )
