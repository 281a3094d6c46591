"""The paper's table with its long studies.

    python -m benchmarks.paper.long --out DIR [--coarse] [--set NAME|FILE] [--refine F]
        [--meshes N] [--open N] [--no-gripper] [--workers N]

From the root of the repository. Adds to the table of `python -m benchmarks.paper` how random meshes and the
values that the paper leaves open move it. A run that was stopped goes on.
"""

from __future__ import annotations

import sys
from pathlib import Path

from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress, json_lines, terminal

from ..options import parser, settings_of
from ..table.run import console_summary
from .run import LongSettings, reproduce


def main(arguments: list[str]) -> int:
    command = parser("python -m benchmarks.paper.long", __doc__)
    command.add_argument(
        "--meshes",
        type=int,
        default=None,
        metavar="N",
        help="Number of random meshes of each kind; 0: those of meshes.csv here "
        "(default: 12; 0 with --coarse).",
    )
    command.add_argument(
        "--open",
        dest="points",
        type=int,
        default=0,
        metavar="N",
        help="Number of sampled parameter sets to solve, which takes hours; 0: those of open.csv here "
        "(default: 0).",
    )
    options = command.parse_args(arguments)
    progress = Progress([json_lines(sys.stdout) if options.json else terminal(sys.stderr)])
    with run_to_end(progress) as context:
        meshes = options.meshes if options.meshes is not None else 0 if options.coarse else 12
        settings = LongSettings(settings_of(options), meshes, options.points)
        reproduce(settings, Path(options.out), context)
    if context.status == 0 and not options.json:
        print("\n".join([f"results: {context.folder}", *console_summary(context.summary)]))
    return context.status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
