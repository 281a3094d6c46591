"""Figures of the documentation: CSV files that benchmarks write, and the tables of the pages made from them.

    python -m benchmarks.figures record NAME COMMAND ...   run a benchmark, keep its tables as NAME.csv
    python -m benchmarks.figures fill                      write every table of the pages anew

A page marks the place of a table with `<!-- figures/NAME.csv -->`; `<!-- figures/NAME.csv last -->` keeps the
last of the rows that agree in their first two cells, such as the finest mesh of each element. Of
`<!-- figures/NAME.csv linked -->` the page has only a link.
"""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from pathlib import Path

PAGES = Path(__file__).parents[1] / "docs" / "engineering"
FIGURES = PAGES / "figures"
# A mark, and the table and its source that stand below it.
MARK = re.compile(r"(<!-- figures/([\w-]+)\.csv( last| linked)? -->\n)((?:\|.*\n)*)(\n\*.*\*\n)?")


def tables(text: str) -> list[tuple[str, list[list[str]]]]:
    """The Markdown tables of a text, each with the heading above it; cells as text, the head first."""
    found: list[tuple[str, list[list[str]]]] = []
    title, before = "", ""
    for line in text.splitlines():
        if line.startswith("#"):
            title = line.lstrip("# ")
        elif line.startswith(("| ---", "|---")):
            continue
        elif line.startswith("|"):
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if not before.startswith("|"):
                found.append((title, []))
            found[-1][1].append(cells)
        before = line
    return found


def record(name: str, command: list[str]) -> Path:
    """Run a benchmark and keep its tables; raises ValueError where it prints none."""
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    found = tables(done.stdout)
    if not found:
        raise ValueError(f"{' '.join(command)} printed no table")
    measured = next((line for line in done.stdout.splitlines() if "commit" in line), "")
    head, many = found[0][1][0], len(found) > 1
    path = FIGURES / f"{name}.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {' '.join(command)}\n# {measured}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*(["case"] if many else []), *head])
        for title, rows in found:
            if len(rows[0]) == len(head):
                writer.writerows([*([title] if many else []), *row] for row in rows[1:])
    return path


def table(path: Path, last: bool = False) -> tuple[str, str]:
    """The Markdown table of a CSV file, and its command and circumstances in a line."""
    lines = path.read_text(encoding="utf-8").splitlines()
    source = [line.removeprefix("# ") for line in lines if line.startswith("#")]
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    if last:
        rows = list({tuple(row[:2]): row for row in rows}.values())
    text = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    text += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(text) + "\n", f"\n*`{source[0]}`. {source[1]}*\n"


def filled(page: str, figures: Path = FIGURES) -> str:
    """A page with every table that it marks made from its CSV file."""

    def one(match: re.Match[str]) -> str:
        if match[3] == " linked":
            return match[0]
        return match[1] + "".join(table(figures / f"{match[2]}.csv", bool(match[3])))

    return MARK.sub(one, page)


def main() -> None:
    match sys.argv[1:]:
        case ["record", name, *command] if command:
            print(record(name, command))
        case ["fill"]:
            for path in sorted(PAGES.glob("*.md")):
                path.write_text(filled(path.read_text(encoding="utf-8")), encoding="utf-8")
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    main()
