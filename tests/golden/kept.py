"""What is kept of a command's run: {where: value as text}, sorted, without what no two runs share."""

import csv
import json
import math
import re
import tomllib
from itertools import chain

FEW = 16
"""Rows of a table that are kept as they are; of more, count, sum, least, largest, first and last."""
DIGITS = 9
LEFT_OUT = re.compile(
    r"""(^|\.)(\w*seconds\w*|versions?|revision|hash|digest|\w*sha256|mu_addon|uuid|process|processor\w*|cost_s|started|ended
        |date|time|created|written|finished|\w*memory_MB|workers?|largest_relative_residual|cubic_error)(\.|$|\[)""",
    re.VERBOSE,
)
"""Keys of times, places, versions, hashes, what an iteration leaves, and how symmetric a mesh came out."""
NOT_LISTED = re.compile(r"(^|/)(cache|nodes|__pycache__|\.[^/]*)/|(^|/)run\.lock$|\.tmp$")
"""Files that are no result: their names are hashes, or they go with the process."""
NOT_SAID = re.compile(
    r"^\s*\d+ %  |^about .* stages?$|^\s*$|: (for|done in) \d| \.\.\.$|processor|seconds left"
)
"""Lines of the terminal that tell how fast it goes."""
HASH = re.compile(r"\b[0-9a-f]{32,64}\b|(?<=[a-z]-)[0-9a-f]{16}\b")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
DATE = re.compile(r"\d\d [A-Z][a-z]{2} \d\d:\d\d")
DURATION = re.compile(r"\b\d+(?:\.\d+)? (?:ms|s|min|h|MB)\b(?: \d+ s\b)?")


def number(value):
    """A number at its reproducible digits; no sign of zero."""
    if not isinstance(value, float) or not math.isfinite(value):
        return json.dumps(value, ensure_ascii=False)
    return f"{float(f'{value:.{DIGITS}g}') + 0.0:.{DIGITS}g}"


def flat(value, where=""):
    """Leaves of nested dicts and lists; a plain list is one leaf, a long list of dicts one a key."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flat(inner, f"{where}.{key}" if where else str(key))
    elif not isinstance(value, list):
        yield where, number(value)
    elif len(value) > FEW:
        if all(isinstance(v, dict) for v in value):
            for key in sorted(set(chain.from_iterable(value))):
                yield from flat([v.get(key) for v in value], f"{where}[].{key}")
        elif all(isinstance(v, list) for v in value):
            yield from flat(list(chain.from_iterable(value)), where)
        else:
            yield where, summed_up([json.dumps(v).strip('"') for v in value])
    elif any(isinstance(v, dict | list) for v in value):
        for k, inner in enumerate(value):
            yield from flat(inner, f"{where}[{k}]")
    else:
        yield where, "[" + ", ".join(map(number, value)) + "]"


def summed_up(cells):
    """Of many cells: of numbers count, sum of sizes, least and largest, of words how many; first and last."""
    values = [as_number(cell) for cell in cells]
    if None in values:
        return f"{len(set(cells))} different of {len(cells)}, first {cells[0]}, last {cells[-1]}"
    finite = [v for v in values if math.isfinite(v)]
    if not finite:
        return f"0 of {len(cells)}"
    of = {"sizes": math.fsum(map(abs, finite)), "min": min(finite), "max": max(finite)}
    of |= {"first": finite[0], "last": finite[-1]}
    return f"{len(finite)} of {len(cells)}" + "".join(f", {name} {number(v)}" for name, v in of.items())


def table(text, numbers=True):
    """Of a CSV file: columns, and its rows or what these sum up to."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    head, *body = csv.reader(lines) if lines else [[]]
    kept = [k for k, name in enumerate(head) if not LEFT_OUT.search(name)]
    head, *body = ([row[k] for k in kept] for row in (head, *body))
    yield "columns", ",".join(head)
    if not numbers:
        return
    yield "rows", str(len(body))
    if len(body) <= FEW:
        yield from ((f"row {k:02d}", ",".join(row)) for k, row in enumerate(body))
        return
    yield from ((name, summed_up(cells)) for name, cells in zip(head, zip(*body, strict=True), strict=True))


def as_number(cell):
    """A cell's number, nan where it is empty, None where it is a word."""
    try:
        return float(cell.replace("null", "") or "nan")
    except ValueError:
        return None


def headings(text):
    """Headings of a page: what it shows, in order."""
    found = re.findall(r"<h[1-4][^>]*>(.*?)</h[1-4]>", text, re.DOTALL)
    return [re.sub(r"<[^>]*>|\s+", " ", heading).strip() for heading in found]


def said(text):
    """Lines of the terminal, without progress and times, whatever width they have in a column."""
    told = (DURATION.sub("(time)", x.rstrip()) for x in text.splitlines() if not NOT_SAID.search(x))
    return [re.sub(r" +\(time\)", " (time)", x) for x in told]


def leaves_of(path, timed):
    """What is compared of a file: a table, JSON, TOML, or the headings of a page."""
    if path.suffix not in (".csv", ".json", ".toml", ".html"):
        return
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".csv":
        yield from table(text, not timed)
    elif path.suffix == ".html":
        yield "headings", "; ".join(headings(text))
    else:
        yield from flat(json.loads(text) if path.suffix == ".json" else tomllib.loads(text))


def of_folder(folder, timed=False):
    """Leaves of every table, JSON and TOML file of a folder, and its files' names."""
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder).as_posix()
        if NOT_LISTED.search(name):
            continue
        yield name, "is there"
        for where, value in leaves_of(path, timed):
            if not LEFT_OUT.search(where):
                value = NUMBER.sub("#", value) if timed and path.suffix != ".csv" else value
                yield f"{name}: {where}", HASH.sub("(hash)", value)


def differences(recorded, found, rtol):
    """What is not the same, in words."""
    for key in sorted(recorded.keys() | found.keys()):
        old, new = recorded.get(key, "(not there)"), found.get(key, "(not there)")
        if not same(old, new, rtol):
            yield f"{key}\n    recorded: {old}\n    now:      {new}"


def same(old, new, rtol):
    """Whether texts have the same words, and the same numbers but for `rtol` and half a last digit each."""
    if NUMBER.sub("#", old) != NUMBER.sub("#", new):
        return False
    pairs = list(zip(NUMBER.findall(old), NUMBER.findall(new), strict=True))
    # The numbers of one column share its scale.
    column = max(abs(float(a)) for a, _ in pairs) if ", sizes " in old else 0.0
    return all(_near(a, b, rtol, column) for a, b in pairs)


def _near(a, b, rtol, scale):
    x, y = float(a), float(b)
    allowed = rtol * max(abs(x), abs(y), scale) + max(_last_digit(a), _last_digit(b))
    return x == y or abs(x - y) <= 1.000001 * allowed


def _last_digit(text):
    """What one unit of the last digit of a decimal is worth; none for a whole number, which is a count."""
    digits, _, power = text.lower().partition("e")
    decimals = len(digits.partition(".")[2])
    return 10.0 ** (int(power or 0) - decimals) if decimals else 0.0


def written(leaves):
    """The text of a recorded file."""
    return "".join(
        f"{key} = {json.dumps(value, ensure_ascii=False)[1:-1]}\n" for key, value in sorted(leaves.items())
    )


def read(text):
    """Leaves of the text of a recorded file."""
    pairs = (line.partition(" = ") for line in text.splitlines())
    return {key: json.loads(f'"{value}"') for key, _, value in pairs}
