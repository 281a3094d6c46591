"""Parameter studies: many studies that differ in some inputs; their plan, their points, and effects."""

from typing import TYPE_CHECKING

from ...lazy import public_face

if TYPE_CHECKING:
    from .plan import Plan, read_plan
    from .point import Outcome, Task
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
