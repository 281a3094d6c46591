"""The command line: its parser, and how a run of a subcommand begins and ends."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import __version__
from . import PAGES, all_commands
from .closed_pipe import leave_quietly, until_closed
from .completion import SHELLS, Complete
from .resume import KEPT

if TYPE_CHECKING:
    from ..run.progress import Sink

STATUSES = (
    "exit status: 0 success, 1 other failure, 2 invalid input, 3 meshing failed, 4 no equilibrium found, 5 "
    "cannot write, 6 not printable, 70 internal error, 71 crashed or killed, 130 Ctrl-C, 141 output closed, "
    "143 terminated"
)


# Options that are kept under another name than their own.
_OPTIONS = {"wall_resin": "--resin", "obstacles": "--obstacle"}


class _Commands(argparse._SubParsersAction):
    """Shows a subcommand's summary and page in its own --help, too, and gives every subcommand --quiet."""

    def add_parser(self, name: str, **options: Any) -> Any:
        page = f" Page: docs/guide/{PAGES[name]}.md." if name in PAGES else ""
        words = f"{options['help']}{page}"
        command = super().add_parser(name, description=words, allow_abbrev=False, **options)
        command.add_argument(
            "--quiet",
            action="store_true",
            help="Show errors and results only; progress and warnings stay in the folder's log.ndjson.",
        )
        return command


class _Parser(argparse.ArgumentParser):
    """Reports an error in one line, with the closest valid word, and where help is."""

    def parse_args(self, args: Any, namespace: Any = None) -> Any:  # type: ignore[override]
        """The options; an option that a command does not have ends the process, with what may be meant."""
        # Before a missing one is reported, which may be the one that is meant.
        for word in args[1:]:
            if word.startswith("--"):
                self._require_known(args[0], word.partition("=")[0])
        options, unknown = self.parse_known_args(args, namespace)
        if unknown:
            self.error(f"unexpected: {' '.join(unknown)}")
        return options

    def _require_known(self, command: str, flag: str) -> None:
        (choices,) = [action.choices for action in self._actions if isinstance(action, _Commands)]
        of_command = choices[command]._actions if command in choices else ()
        known = [own for action in of_command for own in action.option_strings]
        if flag in known or not known:
            return
        from ..design.parameters import SECTIONS
        from ..design.quantity import describe
        from ..errors import did_you_mean

        name, hint = flag.lstrip("-").replace("-", "_"), did_you_mean(flag, known, 0.75)
        for section in () if hint else SECTIONS:
            table = str(section.section)  # type: ignore[attr-defined]
            for d in describe(section):
                if not hint and name in (table, d.name, d.name.removesuffix(f"_{d.unit}")):
                    hint = f": the file of --unit sets [{table}] {d.name}, see docs/guide/parameters.md"
        choices[command].error(f"{command} has no option {flag}{hint}")

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from ..errors import did_you_mean

            names = [str(name) for name in action.choices]
            words = f"{value!r} is unknown{did_you_mean(str(value), names)} (choose from {', '.join(names)})"
            raise argparse.ArgumentError(action, words)

    def error(self, message: str) -> None:  # type: ignore[override]
        from ..run.progress import printable

        help_ = f"`{self.prog} --help` lists the commands and options"
        self.exit(2, printable(f"error: {message}\n  what to do: {help_}\n", sys.stderr))


def parser() -> argparse.ArgumentParser:
    """The parser of the whole command line."""
    top = _Parser(
        "run.py",
        description="Design, simulate and sensorise Monolithic Units, soft pneumatic actuators with a "
        "lattice and an optical waveguide.",
        epilog=STATUSES,
    )
    top.add_argument("--version", action="version", version=f"mu_addon {__version__}")
    top.add_argument(
        "--completion",
        choices=SHELLS,
        action=Complete,
        help='Print a script that completes commands, options and choices: eval "$(... --completion bash)".',
    )
    commands = top.add_subparsers(
        dest="command", required=True, metavar="COMMAND", parser_class=_Parser, action=_Commands
    )
    for command in all_commands().values():
        command.add(commands)
    return top


def _require_usable(options: argparse.Namespace) -> None:
    """Raise InputError for values that no option can have: nan, and names that are empty or no text.

    An empty --out has a separate message.
    """
    from ..errors import InputError

    for name, given in vars(options).items():
        where = _OPTIONS.get(name, f"--{name.replace('_', '-')}")
        for value in given if isinstance(given, list | tuple) else [given]:
            if isinstance(value, float) and math.isnan(value):
                raise InputError("nan is not a number", where, "give a number")
            if not isinstance(value, str) or (name == "out" and not value):
                continue
            if not value:
                raise InputError("it is empty", where, "give a name, or leave the option out")
            if "\0" in value or value != value.encode(errors="replace").decode():
                raise InputError(
                    "it contains a NUL byte, or bytes that are not UTF-8 text", where, "give a name in UTF-8"
                )


def _short_report(folder: Path, why: str) -> None:
    # Needed only by a run that is asked to stop.
    from ..report.stopped import write_stopped_report

    write_stopped_report(folder, why)


def sink_of(options: argparse.Namespace) -> Sink:
    """Sink of messages by --json and --quiet: lines on a terminal, or JSON; all, or only the outcome."""
    from ..run.progress import json_lines, outcome, terminal

    sink = until_closed(json_lines(sys.stdout) if getattr(options, "json", False) else terminal(sys.stderr))
    return outcome(sink) if options.quiet else sink


def main(arguments: list[str]) -> int:
    """Run one command line; returns its exit status and never raises."""
    try:
        return _main(arguments)
    except BrokenPipeError:
        # While the results were printed: the run itself has ended.
        return 0
    finally:
        leave_quietly()


def _main(arguments: list[str]) -> int:
    options = parser().parse_args(arguments)
    command = all_commands()[options.command]

    # Imported late, so that --help answers at once.
    from ..run.context import run_to_end
    from ..run.heartbeat import to_watcher
    from ..run.progress import Progress, printable
    from ..run.supervisor import send

    # The watcher first: it would repeat an older share after the one that a terminal shows.
    progress = Progress([to_watcher(send), sink_of(options)])
    with run_to_end(progress) as context:
        _require_usable(options)
        context.wants_report = getattr(options, "report", True) is not False
        if given := {name: getattr(options, name) for name in KEPT if hasattr(options, name)}:
            context.summary["options"] = given
        context.short_report = _short_report
        context.repeats = True
        with context.progress.beating():
            command.run(options, context)
    if context.status == 0 and not getattr(options, "json", False):
        results = [f"results: {context.folder}"] if context.folder is not None else []
        applied = context.summary.get("model", {}).get("applied", ())
        results += [f"applied from {options.model}: {words}" for words in applied]
        lines = [*results, *context.console_summary(context.summary)]
        sys.stdout.write(printable("\n".join(lines), sys.stdout) + "\n")
    return context.status
