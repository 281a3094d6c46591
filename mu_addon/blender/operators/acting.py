"""What the operators share: the unit they act on, and errors told as the core tells them."""

from __future__ import annotations

from functools import wraps

from ...errors import MuError
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
