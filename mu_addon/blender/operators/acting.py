"""What the operators share: the unit they act on, and errors told as the core tells them."""

from __future__ import annotations

from functools import wraps

from ...errors import MuError
from ...study.client import RUNNING
from .. import live, simulation
from ..unit_object import active_root

NO_UNIT = "Select a Monolithic Unit, or add one: Add > Mesh > Monolithic Unit"


class OnUnit:
    """An operator on the active unit; greyed, with the reason, where there is none."""

    @classmethod
    def poll(cls, context):
        if active_root(context) is None:
            cls.poll_message_set(NO_UNIT)
            return False
        return True


class OnSoundUnit(OnUnit):
    """An operator on the active unit that needs parameters which break no rule."""

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        trouble = active_root(context).mu_unit.trouble
        if trouble:
            cls.poll_message_set(f"The parameters break a rule: {trouble.splitlines()[0]}")
            return False
        return True


class OnJob(OnUnit):
    """An operator on a job that runs, or ran, for the active unit in a process of its own."""

    @staticmethod
    def job_of(root) -> str:
        """The job's name, see `simulation.of`: the unit's own simulation."""
        return root.mu_unit.uuid


class CancelsJob(OnJob):
    """Stops the job; greyed, with the reason, where none runs."""

    idle = "Nothing runs for this unit"

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        child = simulation.of(cls.job_of(active_root(context)))
        if child is None or child.state != RUNNING:
            cls.poll_message_set(cls.idle)
            return False
        return True

    def execute(self, context):
        simulation.of(self.job_of(active_root(context))).cancel()
        live.redraw()
        return {"FINISHED"}


class DismissesJob(OnJob):
    """Takes the message of an ended job off the panel."""

    def execute(self, context):
        simulation.forget(self.job_of(active_root(context)))
        return {"FINISHED"}


def telling(execute):
    """`execute` that reports a MuError, what, where and remedy, and cancels: no undo step, no traceback."""

    @wraps(execute)
    def told(self, context):
        try:
            return execute(self, context)
        except MuError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    return told
