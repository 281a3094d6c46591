"""How long Blender's window stands still at each of some seventy gestures, drawing included.

    MU_BLENDER_UI... python -m benchmarks.heartbeat

(MU_BLENDER_UI as of tests/blender/test_installed.py: a Blender with a window, where the built extension is
installed.) A timer beats in the window while tests/blender/gestures_in_window.py goes through its gestures. A
row tells of the longest time between two beats, by the clock and by the main thread's processor time. Without
a graphics card the processor draws, too: the row "a frame and nothing else" is what that alone takes.
"""

import json
import os
import shlex
import subprocess
import tempfile
from pathlib import Path

from benchmarks.table import circumstances, options_of, print_head

GESTURES = Path(__file__).resolve().parents[1] / "tests" / "blender" / "gestures_in_window.py"
SECONDS = 1800


def measured(folder):
    """Gestures in their order, and the longest block of each by clock and processor in s."""
    window = shlex.split(os.environ["MU_BLENDER_UI"])
    command = [*window, str(GESTURES), str(folder / "last.png"), str(SECONDS)]
    environment = {**os.environ, "MU_TEST_FOLDER": str(folder), "MU_HEARTBEAT": "1"}
    subprocess.run(command, env=environment, check=False, capture_output=True)
    outcome = (folder / "outcome.txt").read_text()
    found = json.loads((folder / "blocked.json").read_text())
    return outcome, found["gestures"], found["longest_s"]


def main():
    parser = options_of(__doc__)
    parser.add_argument("--above", type=float, default=0.0, help="least processor time in ms of a row")
    above = parser.parse_args().above
    with tempfile.TemporaryDirectory() as scratch:
        outcome, gestures, longest = measured(Path(scratch))
    print(circumstances(), end="\n\n")
    print_head("gesture", "clock (ms)", "processor (ms)")
    for name in gestures:
        clock, processor = (1000.0 * s for s in longest.get(name, (0.0, 0.0)))
        if processor >= above:
            print(f"| {name} | {clock:.0f} | {processor:.0f} |")
    print(f"\n{outcome}")


if __name__ == "__main__":
    main()
