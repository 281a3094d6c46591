"""The paper's Table I and bending ranges beside this simulation's.

    python -m benchmarks.paper --out DIR [--coarse] [--set NAME|FILE] [--refine F] [--no-gripper]
        [--workers N]

From the root of the repository. A run that was stopped goes on.
"""

from __future__ import annotations

import sys
from pathlib import Path

from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress, json_lines, terminal

from .options import parser, settings_of
from .table.run import USE_CASE


def main(arguments: list[str]) -> int:
    options = parser("python -m benchmarks.paper", __doc__).parse_args(arguments)
    progress = Progress([json_lines(sys.stdout) if options.json else terminal(sys.stderr)])
    with run_to_end(progress) as context:
        USE_CASE.start(settings_of(options), Path(options.out), context)
    if context.status == 0 and not options.json:
        print("\n".join([f"results: {context.folder}", *USE_CASE.console_summary(context.summary)]))
    return context.status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
