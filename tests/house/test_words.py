"""The words of the house: retired ones stay out, and every link into a page meets a heading."""

import argparse
import ast
import re
from functools import cache
from pathlib import Path

import pytest

from mu_addon.cli.main import parser

from .sources import SOURCES, nodes

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]

# Phrases of texts, with the term of the glossary that took their place.
PHRASES = {
    "beaten by none": "Pareto-optimal",
    "no other beats": "Pareto-optimal",
    "chance of a false name": "false-positive probability",
    "foretold": "leave-one-out error",
    "would stumble over": "printability check",
    "says more": "has a larger signal",
    "may be pulled": "a plain statement of the direction",
    "kept by content": "cached by content hash",
    "unpressed": "at zero pressure",
    "model as it was": "base model",
    "hangs on nothing": "is not connected",
    "begins on nothing": "island",
    "of one's own": "user-defined",
    "what was said while it ran": "log of this run",
    "what mending": "error reduction",
    "lockstep": "batched Newton method",
    "unbeaten": "Pareto-optimal",
}
# Identifiers and their parts, with what they are called now.
IDENTIFIERS = {
    "lockstep": "batched_newton",
    "marching": "time_stepping",
    "unpressed": "at_zero_pressure",
    "rubs": "has_friction",
    "weighs": "has_gravity",
    "told_apart": "a chi-squared threshold by its name",
    "stuffed": "cobs_encoded",
    "reviewed": "reselected",
    "surprise": "predictor_tolerance",
    "march": "simulate_in_time",
    "spoken": "what it prints",
    "told": "message, lines or output",
    "said": "message, lines or output",
    "untold": "unrecognised",
    "heard": "received",
    "chance": "probability",
    "telling": "representative",
    "quietened": "denoised",
    "walled": "with_flat_obstacle",
    "pasts": "strain_histories",
    "endless": "unwrapped_counter",
    "kinks": "well_angles",
}


def _texts(path):
    """Line and text of every string of a module, docstrings included."""
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, " ".join(node.value.split())


def _messages(path):
    """Every string of a module as a user reads it: "..." stands for each field of an f-string."""
    for node in nodes(path):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(p.value if isinstance(p, ast.Constant) else "..." for p in node.values)


@cache
def _all_messages():
    return [message for path in SOURCES for message in _messages(path)]


def _is_a_message(quoted):
    """Whether some string of the package has these words, with anything in place of each "..."."""
    pattern = re.compile(".*".join(re.escape(part) for part in quoted.split("...")), re.DOTALL)
    return any(pattern.search(message) for message in _all_messages())


def _identifiers(path):
    for node in nodes(path):
        if isinstance(node, ast.Name):
            yield node.lineno, node.id
        elif isinstance(node, ast.Attribute):
            yield node.lineno, node.attr
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg


def _retired_phrases(text):
    text = text.lower()
    return [phrase for phrase in PHRASES if phrase in text]


@cache
def _retired_identifiers(name):
    whole = f"_{name.lower()}_"
    return [word for word in IDENTIFIERS if f"_{word}_" in whole]


def test_no_retired_phrase_in_a_text():
    found = []
    for path in SOURCES:
        texts = list(_texts(path))
        # Most modules have none: all their texts at once, and one by one only where some phrase is.
        if not _retired_phrases("\n".join(text for _, text in texts)):
            continue
        for line, text in texts:
            found += [f"{path.relative_to(ROOT)}:{line}: {p} -> {PHRASES[p]}" for p in _retired_phrases(text)]
    for page in PAGES:
        # Names of code may be old ones, as in the changelog.
        text = re.sub(r"`[^`]*`", "", " ".join(page.read_text(encoding="utf-8").split()))
        found += [f"{page.relative_to(ROOT)}: {p} -> {PHRASES[p]}" for p in _retired_phrases(text)]
    assert found == []


def test_no_retired_identifier():
    found = []
    for path in SOURCES:
        names = [(1, path.stem), *_identifiers(path)]
        for line, name in names:
            found += [
                f"{path.relative_to(ROOT)}:{line}: {name} -> {IDENTIFIERS[w]}"
                for w in _retired_identifiers(name)
            ]
    assert found == []


@pytest.mark.parametrize(
    ("name", "retired"),
    [
        ("run_lockstep", True),
        ("weighs", True),
        ("TOLD_APART", True),
        ("weights", False),
        ("unmarching", False),
    ],
)
def test_the_search_for_identifiers_can_find_one(name, retired):
    assert bool(_retired_identifiers(name)) == retired


def test_the_messages_that_the_page_explains_are_those_of_the_code():
    text = (ROOT / "docs" / "guide" / "blender.md").read_text(encoding="utf-8")
    section = text.split("## When something is wrong")[1]
    starts = re.findall(r"^- ((?:\*[^*\n]+\*(?:, )?)+)", section, re.MULTILINE)
    assert len(starts) == len(re.findall(r"^- ", section, re.MULTILINE))
    quoted = [words for start in starts for words in re.findall(r"\*([^*]+)\*", start)]
    assert len(quoted) >= 10
    assert [words for words in quoted if not _is_a_message(words)] == []


def _labels(text):
    """Names of buttons and fields, in italics in a page of the guide, each part of "A > B" by itself."""
    text = re.sub(
        r"```.*?```|\*\*[^*]+\*\*|\]\([^)]*\)",
        "",
        text.split("## When something is wrong")[0],
        flags=re.DOTALL,
    )
    for found in re.findall(r"(?<![*\w])\*([A-Z][^*]+)\*(?!\*)", text):
        yield from re.split(r" > |: ", " ".join(found.split()))


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "guide").glob("*.md")), ids=lambda page: page.stem)
def test_the_labels_of_the_guide_are_those_of_the_code(page):
    missing = [label for label in _labels(page.read_text(encoding="utf-8")) if not _is_a_message(label)]
    assert missing == []


@pytest.mark.parametrize(
    ("quoted", "expected"),
    [
        ("This unit is being simulated", True),
        ("no equilibrium at ... kPa: ...", True),
        ("This unit is being evaluated", False),
        ("no equilibrium at ... bar", False),
    ],
)
def test_the_search_for_messages_can_find_one(quoted, expected):
    assert _is_a_message(quoted) == expected


def _anchors(page):
    """The anchors that a page's headings make: lower case, spaces as hyphens, punctuation dropped."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    plain = [re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", h) for h in headings]
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in plain}


def test_links_into_pages_meet_a_heading():
    missing = []
    for page in PAGES:
        for target, anchor in re.findall(r"\]\(([^)#\s]*)#([^)\s]+)\)", page.read_text(encoding="utf-8")):
            if target.startswith(("http://", "https://")):
                continue
            aim = page.parent / target if target else page
            if not aim.exists() or anchor not in _anchors(aim):
                missing.append(f"{page.name}: {target}#{anchor}")
    assert missing == []


def test_the_glossary_gives_every_term_once():
    text = (
        (ROOT / "docs" / "engineering" / "glossary.md").read_text(encoding="utf-8").split("## Words with")[0]
    )
    rows = re.findall(r"^\| ([^|]+?) \|", text, re.MULTILINE)
    terms = [term for row in rows for term in row.split(", ") if term not in ("term", "---")]
    assert len(terms) > 100
    assert sorted(terms) == sorted(set(terms))


def test_every_help_text_is_a_sentence():
    (commands,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    texts = {name: command.description for name, command in commands.choices.items()}
    for name, command in commands.choices.items():
        texts |= {f"{name} {a.dest}": a.help for a in command._actions if a.dest != "help"}
    assert [name for name, text in texts.items() if not re.fullmatch(r"[A-Z`].*\.", text or "")] == []
