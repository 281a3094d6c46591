"""Jobs in processes of their own: waiting for them, and a child that says what a test wants."""

import sys
import time
from pathlib import Path

from mu_addon.blender.jobs import start_child
from mu_addon.blender.simulate.job import SIMULATION
from mu_addon.run.child import Child
from mu_addon.run.interpreter import environment

FAKE = str(Path(__file__).resolve().parents[2] / "run" / "fake_worker.py")
# No measure of speed: what hangs must end some time.
PATIENCE_S = 1800.0


def launch(root, how):
    """A fake child as the unit's own simulation."""
    return fake(SIMULATION, root, how)


def fake(kind, root, how, folder=None):
    """A fake child as the job of this kind."""
    folder = (folder or kind.folder_of(root)) / start_child.OWN_FOLDER
    return start_child.watch(kind.key(root), Child([sys.executable, FAKE, how], folder, environment()))


def watch(until):
    """Poll until something holds, ever less often: a poll is not free."""
    # Timers never fire in background: the test is the timer.
    end, pause = time.monotonic() + PATIENCE_S, 0.02
    while not until():
        assert time.monotonic() < end, "it never came"
        start_child.poll()
        time.sleep(pause)
        pause = min(1.1 * pause, 0.25)


def ended(child):
    """Wait until a child has ended; returns it."""
    watch(lambda: child.state != "running")
    return child
