"""`import`: files of test machines and data loggers into a folder of measured data.

Missing information is asked for; without it only the page on the read files is written.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs

from .. import lab_files, measured
from ..design.quantity import described
from ..errors import InputError
from ..run.parts import Chart, Fault, Part, Sentence, Table, Warn, echo, recorded
from ..run.study import Dropped, Input, Study, Tell, given, section, stage
from ..toml_writer import toml_text
from .inputs import PlaceInput, asked, once

PAGE = "import.html"
# Choices that are written into the option which answers a question.
_FEW = 6
# Seconds to read a megabyte of a file, and to write what is in it.
_READ_S, _WRITE_S = 0.8, 0.4
# Bars of a column's course in a terminal, and their heights.
_BARS = 32
_HEIGHTS = "\u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"
Ask = Callable[["lab_files.Understood"], Mapping[str, str] | None]


def _answers(given: Sequence[str] | None) -> dict[str, str]:
    """Answers to questions by their keys, each as KEY=VALUE; raises InputError for one without a key."""
    answers = {}
    for words in given or ():
        key, equals, value = words.partition("=")
        if not equals or not key.strip():
            raise InputError(f"{words!r} is not an answer", "--set", "write it as KEY=VALUE")
        answers[key.strip()] = value.strip()
    return answers


def _seconds(each: float) -> Callable[[Import], float]:
    return lambda study: each * sum(path.stat().st_size for path in study.paths if path.is_file()) / 1e6


@attrs.frozen(kw_only=True, eq=False)
class Import(Study):
    """Import files of test machines and data loggers (CSV, text, Excel, HTML): propose kind, columns, units
    and signs, ask for what is missing, and write a folder of measured data.
    """

    name = "import"
    example = "import tension.csv --set mode=uniaxial --set length_mm=40 --out measured"
    files = {"experiments.toml": "the experiments, as `diagnose` reads them", "*.csv": "their data"}
    joins = True
    page = PAGE

    paths: tuple[Path, ...] = asked(
        PlaceInput,
        "paths",
        "CSV, text, workbook (.xlsx, .xls, .ods) or HTML table, recognised by content",
        empty=attrs.NOTHING,
        argument="FILE",
        many=True,
    )
    answers: dict[str, str] = asked(
        Input,
        "answers",
        "answer to a question, such as kind=coupon, section_mm=12.5x3, length_mm=40, unit.Load=N, "
        "column.Ch1=force, column.2=none, decimal=, or, for one experiment alone, NAME.KEY=VALUE. Name a "
        "column by its title or its number. Repeat the option for each answer",
        empty=attrs.Factory(dict),
        kind="answers",
        value=_answers,
        option="set",
        repeated=True,
        metavar="KEY=VALUE",
    )
    dry: bool = once(
        described(
            "dry_run",
            False,
            "show how the files were read, in the terminal and in import.html, and import nothing",
        )
    )
    ask: Ask | None = given(Input("ask"), default=None)
    """Answers open questions by their keys; else they end the run, after the page is written."""

    @stage("read", _seconds(_READ_S), kept=False)
    def understood(
        self, paths: tuple[Path, ...], answers: dict[str, str], dry: bool, ask: Ask | None, tell: Tell
    ) -> lab_files.Understood:
        """The experiments in the files, with the answers to what they leave open."""
        given = dict(answers)
        found = lab_files.understand(paths, given, lambda count: tell(count / len(paths)))
        while found.open and ask is not None and not dry and (more := ask(found)) is not None:
            # The same question of further experiments has the same answer.
            given |= more
            found = lab_files.understand(paths, given)
        return found

    @stage("import", _seconds(_WRITE_S), wanted=lambda study: not study.dry, kept=False)
    def ready(self, understood: lab_files.Understood, tell: Tell) -> Ready:
        """Entries of the experiments, each read back as `diagnose` reads it; none with open questions."""
        if understood.open:
            raise Dropped
        entries: list[measured.Entry] = []
        remarks: list[measured.Remark] = []
        for k, p in enumerate(understood.proposals):
            tell((k + 0.2) / len(understood.proposals))
            entries.append(entry_of(p))
            try:
                remarks += entries[-1].tried()
            except InputError as error:
                what = f"{p.name}: {error.what}{_changes(p)}"
                raise InputError(what, _at(p, entries[-1].text, error), error.remedy) from error
        return Ready(tuple(entries), tuple(remarks))

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it what it shows."""
        return "Import of measured data", "How the files were read"

    @section()
    def answer(
        self, understood: lab_files.Understood, dry: bool, ready: Ready | None = None
    ) -> Iterator[Part]:
        """The experiments, or the questions that are open."""
        questions = [_asked(p, question) for p, question in understood.asked]
        lines = terminal_lines(understood)
        yield from echo(*lines, f"how the files were read, with pictures: {PAGE}")
        yield recorded("experiments", {p.name: _figures(p) for p in understood.proposals})
        yield recorded("left_out", list(understood.left_out))
        yield recorded("understood", lines)
        if questions:
            yield Sentence(f"Not imported yet. {len(understood.open)} question(s) are open:", note=True)
            for p, question in understood.open:
                yield Sentence(f"{p.name}: {question.text}", note=True)
        if dry:
            yield recorded("dry_run", True)
            yield recorded("questions", questions)
            yield from echo(*(f"open: {words}" for words in questions), "dry run: nothing was imported")
        elif questions:
            yield Fault(_open_questions(understood, questions))
        if ready is not None:
            yield recorded("remarks", [remark.what for remark in ready.remarks])
            for remark in ready.remarks:
                yield Warn(remark.what, remark.where, remark.remedy)
            yield from measured.added(ready.entries)

    @section("experiments", "Experiments")
    def experiments(self, understood: lab_files.Understood) -> Iterator[Part]:
        """Picture, keys, columns and conclusions of each experiment."""
        from ..report.measured_charts import columns_chart, pairs_of

        for p in understood.proposals:
            yield Sentence(f"{p.name}: {p.place}", strong=p.name)
            if pairs := pairs_of(p.columns, p.keys.get("kind", "")):
                words = ", ".join(f"{y} against {x}" for x, y in pairs)
                yield Chart(partial(columns_chart, p.columns, pairs), "", f"{p.name}: {words}")
            yield Table("", ["key", "value"], [[key, str(value)] for key, value in p.keys.items()])
            rows = [[name, p.origin[name], *_extent(v), str(len(v))] for name, v in p.columns.items()]
            yield Table("", ["column", "from", *Table.numbers("least", "most", "rows")], rows)
            for words in (*p.concluded, *(f"not read: {one.words}" for one in p.unread)):
                yield Sentence(words)

    @section("left", "Left out")
    def left(self, understood: lab_files.Understood) -> Iterator[Part]:
        """What is in no experiment."""
        for words in understood.left_out:
            yield Sentence(words)


@attrs.frozen(eq=False)
class Ready:
    """Experiments that can be put into a folder, and remarks on them."""

    entries: tuple[measured.Entry, ...]
    remarks: tuple[measured.Remark, ...]


def entry_of(p: lab_files.Proposal) -> measured.Entry:
    """An experiment as it is put into a folder: comments on its origin, then its rows."""
    file = f"{measured.file_stem(p.name)}.csv"
    lines = [f"from {p.place}"]
    lines += [f"{column} is {source}" for column, source in p.origin.items()]
    lines += [*p.concluded, *(f"not read: {one.words}" for one in p.unread)]
    comments = "".join(f"# {' '.join(words.split())}\n" for words in lines)
    block = "[[experiment]]\n" + toml_text({**p.keys, "file": file})
    return measured.Entry(p.name, block, file, comments + measured.csv_text(p.columns))


def _at(p: lab_files.Proposal, text: str, error: InputError) -> str:
    """Place in the imported file of an error in the table that was made of it."""
    row = re.search(r"\brow (\d+)", error.where)
    k = int(row[1]) - text.split("\n")[: int(row[1])].index(",".join(p.columns)) - 2 if row else -1
    return f"{p.file}, line {p.lines[k]}" if 0 <= k < len(p.lines) else f"{p.source} ({error.where})"


def _changes(p: lab_files.Proposal) -> str:
    """Conclusions on units that change within a column, for an error."""
    return "".join(f" ({words})" for words in p.concluded if "its unit changes" in words)


def _figures(p: lab_files.Proposal) -> dict[str, Any]:
    """Summary of an experiment in plain data."""
    return {
        "kind": p.keys.get("kind", ""),
        "rows": len(p.lines),
        "from": p.source,
        "columns": dict(p.origin),
        "concluded": list(p.concluded),
        "not_read": [one.words for one in p.unread],
    }


def _open_questions(found: lab_files.Understood, questions: list[str]) -> InputError:
    """Error on the open questions: what, where and what to do."""
    options = " ".join(f"--set {_quoted(f'{q.key}={_example(q)}')}" for _, q in found.asked)
    return InputError(
        "the files leave open\n    " + "\n    ".join(questions),
        PAGE,
        f"answer with {options}; for one experiment alone with --set 'NAME.KEY=VALUE'",
    )


def _asked(p: lab_files.Proposal, question: lab_files.Question) -> str:
    return f"{p.name}: {question.text}" + (f"; likely {question.proposed}" if question.proposed else "")


def _example(question: lab_files.Question) -> str:
    shown = {"section_mm": "WIDTHxTHICKNESS", "length_mm": "LENGTH", "interval_s": "SECONDS"}
    few = len(question.choices) <= _FEW
    return question.proposed or shown.get(question.key) or ("|".join(question.choices) if few else "QUANTITY")


def _quoted(text: str) -> str:
    return f"'{text}'" if any(c in text for c in " |()[]*<>;&$%") else text


def terminal_lines(found: lab_files.Understood) -> list[str]:
    """Lines on a terminal: each column with its extent and a sparkline of its course."""
    lines: list[str] = []
    for p in found.proposals:
        kind = p.keys.get("kind", "kind not known yet")
        lines.append(f"{p.name}: {kind}, {len(p.lines)} rows, {p.place}")
        rows = [(name, p.origin[name], *_extent(v), _trace(v)) for name, v in p.columns.items()]
        rows.insert(0, ("column", "from", "least", "most", "curve"))
        widths = [max(len(row[k]) for row in rows) for k in range(4)]
        for row in rows:
            cells = [row[k].ljust(w) if k < 2 else row[k].rjust(w) for k, w in enumerate(widths)]
            lines.append("  " + "  ".join([*cells, row[4]]).rstrip())
        lines += [f"  concluded: {words}" for words in p.concluded]
        lines += [f"  not read: {one.words}" for one in p.unread]
    return [*lines, *(f"not read: {words}" for words in found.left_out)]


def _extent(values: Any) -> tuple[str, str]:
    """The least and the largest value as text, empty where all are missing."""
    import numpy as np

    if not np.isfinite(values).any():
        return "", ""
    return f"{np.nanmin(values):.6g}", f"{np.nanmax(values):.6g}"


def _trace(values: Any) -> str:
    """Course of a column as a row of bars, each the mean of an equal part."""
    import numpy as np

    values = values[np.isfinite(values)]
    if not len(values):
        return ""
    means = np.array([part.mean() for part in np.array_split(values, min(_BARS, len(values)))])
    extent = float(np.ptp(means))
    heights = (means - means.min()) / extent if extent else np.zeros(len(means))
    return "".join(_HEIGHTS[int(h * (len(_HEIGHTS) - 1) + 0.5)] for h in heights)
