"""Import of files of test machines and data loggers into a folder of measured data.

Missing information is asked for; without it only the page on the read files is written.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import write_text
from ...lab_files.proposal import Proposal, Question
from ...measured.table import Remark
from ...measured.writing import csv_text, file_stem, put, require_free, tried
from ...run.context import RunContext
from ...toml_writer import toml_text
from .report import page_of, terminal_lines
from .understood import Understood, understand

PAGE = "import.html"
# Choices that are written into the option which answers a question.
_FEW = 6
# Seconds to read a megabyte of a file, and to write what is in it; shorter imports have no plan.
_READ_S, _WRITE_S, _SHORT_S = 0.8, 0.4, 3.0
Ask = Callable[[Proposal, Question], str]


def import_files(
    files: Sequence[Path],
    folder: Path,
    answers: Mapping[str, str],
    context: RunContext,
    ask: Ask | None = None,
    show: Callable[[list[str]], None] = lambda lines: None,
    dry: bool = False,
) -> tuple[Proposal, ...]:
    """Import the experiments of files into a folder of measured data; fills `context.summary`.

    ask: answers a question; without it open questions raise InputError, after the page is written. show: gets
    the page as lines of a terminal before questions. dry: write the page only, and report open questions.
    """
    given = dict(answers)
    remarks: list[Remark] = []
    done = _planned(files, context)
    with context.progress.stage("read"):
        # A file that is missing or holds no table leaves no folder.
        found = understand(files, given, done)
    context.open_folder(folder)
    context.console_summary = console_summary
    with context.progress.stage("import"):
        if found.open and not dry:
            show(terminal_lines(found))
        while found.open and ask is not None and not dry:
            # The same question of further experiments has the same answer.
            given |= {question.key: ask(p, question) for p, question in found.asked}
            found = understand(files, given)
        if dry:
            write_page(found, folder)
        else:
            remarks = write(found, folder, context.progress.update)
    for remark in remarks:
        context.progress.warning(remark.what, remark.where, remark.remedy)
    context.summary |= {
        "experiments": {p.name: _figures(p) for p in found.proposals},
        "left_out": list(found.left_out),
        "remarks": [remark.what for remark in remarks],
        "understood": terminal_lines(found),
        "report": str(folder / PAGE),
    }
    if dry:
        questions = [_asked(p, question) for p, question in found.asked]
        context.summary |= {"dry_run": True, "questions": questions}
    return found.proposals


def write_page(found: Understood, folder: Path) -> None:
    """Write the page on the read files; raises OutputError."""
    write_text(folder / PAGE, page_of(found, folder.name))


def _planned(files: Sequence[Path], context: RunContext) -> Callable[[int], None]:
    """Plan the stages by the sizes of the files; the result reports that so many files are read."""
    sizes = [path.stat().st_size / 1e6 if path.is_file() else 0.0 for path in files]
    whole = sum(sizes)
    if whole * (_READ_S + _WRITE_S) > _SHORT_S:
        context.progress.plan([("read", _READ_S * whole), ("import", _WRITE_S * whole)])
    return lambda count: context.progress.update(sum(sizes[:count]) / whole if whole else 1.0)


def write(
    found: Understood, folder: Path, done: Callable[[float], None] = lambda fraction: None
) -> list[Remark]:
    """Write the page and, without open questions, all experiments, each read back as `diagnose` reads it.

    Returns the remarks of that reader. done: called with the written fraction. Raises InputError where a
    question is open, OutputError.
    """
    write_page(found, folder)
    if found.open:
        raise InputError(*_open_questions(found, folder))
    ready: list[tuple[str, str, str]] = []
    remarks: list[Remark] = []
    for k, p in enumerate(found.proposals):
        done((k + 0.2) / len(found.proposals))
        file = f"{file_stem(p.name)}.csv"
        block = "[[experiment]]\n" + toml_text({**p.keys, "file": file})
        text = _table(p)
        try:
            remarks += tried(block, file, text)
        except InputError as error:
            raise InputError(
                f"{p.name}: {error.what}{_changes(p)}", _at(p, text, error), error.remedy
            ) from error
        require_free(folder, p.name, block, file)
        ready.append((block, file, text))
    for entry in ready:
        put(folder, *entry)
    return remarks


def _at(p: Proposal, text: str, error: InputError) -> str:
    """Place in the imported file of an error in the table that was made of it."""
    row = re.search(r"\brow (\d+)", error.where)
    k = int(row[1]) - text.split("\n")[: int(row[1])].index(",".join(p.columns)) - 2 if row else -1
    return f"{p.file}, line {p.lines[k]}" if 0 <= k < len(p.lines) else f"{p.source} ({error.where})"


def _changes(p: Proposal) -> str:
    """Conclusions on units that change within a column, for an error."""
    return "".join(f" ({words})" for words in p.concluded if "its unit changes" in words)


def _table(p: Proposal) -> str:
    """CSV file of an experiment: comments on its origin, then its rows."""
    lines = [f"from {p.place}"]
    lines += [f"{column} is {source}" for column, source in p.origin.items()]
    lines += [*p.concluded, *(f"not read: {one.words}" for one in p.unread)]
    comments = "".join(f"# {' '.join(words.split())}\n" for words in lines)
    return comments + csv_text(p.columns)


def _figures(p: Proposal) -> dict[str, Any]:
    """Summary of an experiment in plain data."""
    return {
        "kind": p.keys.get("kind", ""),
        "rows": len(p.lines),
        "from": p.source,
        "columns": dict(p.origin),
        "concluded": list(p.concluded),
        "not_read": [one.words for one in p.unread],
    }


def _open_questions(found: Understood, folder: Path) -> tuple[str, str, str]:
    """Message on the open questions: what, where and what to do."""
    lines = [_asked(p, question) for p, question in found.asked]
    options = " ".join(f"--set {_quoted(f'{q.key}={_example(q)}')}" for _, q in found.asked)
    what = "the files leave open\n    " + "\n    ".join(lines)
    return (
        what,
        str(folder / PAGE),
        f"answer with {options}; for one experiment alone with --set 'NAME.KEY=VALUE'",
    )


def _asked(p: Proposal, question: Question) -> str:
    return f"{p.name}: {question.text}" + (f"; likely {question.proposed}" if question.proposed else "")


def _example(question: Question) -> str:
    shown = {"section_mm": "WIDTHxTHICKNESS", "length_mm": "LENGTH", "interval_s": "SECONDS"}
    few = len(question.choices) <= _FEW
    return question.proposed or shown.get(question.key) or ("|".join(question.choices) if few else "QUANTITY")


def _quoted(text: str) -> str:
    return f"'{text}'" if any(c in text for c in " |()[]*<>;&$%") else text


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines on the read files, and on open questions in a dry run."""
    lines = [*summary["understood"], f"how the files were read, with pictures: {summary['report']}"]
    if summary.get("dry_run"):
        lines += [f"open: {question}" for question in summary["questions"]] + [
            "dry run: nothing was imported"
        ]
    return lines
