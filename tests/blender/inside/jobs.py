"""Jobs in processes of their own: waiting for them, and a child that says what a test wants."""

import sys
import time
from pathlib import Path

from mu_addon.blender.simulate import state as simulation
from mu_addon.blender.simulate import study_folder as studies

FAKE = str(Path(__file__).resolve().parents[2] / "run" / "fake_worker.py")
# No measure of speed: what hangs must end some time.
PATIENCE_S = 1800.0


def launch(root, how):
    """A fake child as the unit's own simulation."""
    return fake(root.mu_unit.uuid, how, studies.folder_of(root))


def fake(job, how, folder):
    """A fake child as the job of this name."""
    return simulation.launch(job, [sys.executable, FAKE, how], folder / "blender")


def watch(until):
    """Poll until something holds."""
    # Timers never fire in background: the test is the timer.
    end = time.monotonic() + PATIENCE_S
    while not until():
        assert time.monotonic() < end, "it never came"
        simulation.poll()
        time.sleep(0.05)


def ended(child):
    """Wait until a child has ended; returns it."""
    watch(lambda: child.state != "running")
    return child
