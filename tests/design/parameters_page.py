"""The table in docs/guide/parameters.md, from the code: python -m tests.design.parameters_page."""

from pathlib import Path

from mu_addon.design.parameters import SECTIONS
from mu_addon.design.quantity import describe

PAGE = Path(__file__).parents[2] / "docs" / "guide" / "parameters.md"
HEAD = "| --- | --- | --- | --- | --- | --- |\n"


def page():
    """The page with the table that the code gives."""
    rows = []
    for section in SECTIONS:
        for d in describe(section):
            default = str(d.default).lower() if d.type in (bool, str) else f"{d.default:g}"
            text = f"{d.text}{' *' if d.fixed else ''}"
            source = "assumed" if d.assumed else "paper"
            bold = "" if d.group else "**"
            name = f"{bold}`{section.section}.{d.name}`{bold}"
            rows.append(f"| {name} | {default} | {d.unit} | {d.allowed} | {text} | {source} |\n")
    return PAGE.read_text(encoding="utf-8").partition(HEAD)[0] + HEAD + "".join(rows)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
