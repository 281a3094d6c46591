"""Files exported by test machines and data loggers: cells, blocks of numbers, quantities, a proposal.

`source` gives rows of cells in one of `formats`, `blocks` finds the tables in them, `cells` reads columns as
numbers, `columns` knows titles and units. A `proposal` is one immutable table of the columns that are read;
`steps` names in order the functions that make an experiment of it, each of which decides one thing and says
why. `decisions` lists which function decides what. `understood` reads whole files, `tracked_table` those of
trackers.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .proposal import Proposal, Question
    from .tracked_table import PROJECTS, SUFFIXES, read_pixels
    from .understood import Understood, understand
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
