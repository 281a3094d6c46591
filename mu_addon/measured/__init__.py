"""Measured data: a folder of experiments (`experiments.toml` and CSV files), read and checked.

`read_folder` gives a `Measured` with its experiments in the order in which they were made; a fault in a file
raises an InputError with file, row and remedy.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .bench import Bench as Bench
    from .bench import Filmed as Filmed
    from .bench import entry_of as entry_of
    from .bench import filmed as filmed
    from .bench import pixels_text as pixels_text
    from .bench import read_bench as read_bench
    from .bench import read_pressure as read_pressure
    from .experiment import Experiment as Experiment
    from .folder import Measured as Measured
    from .folder import read_folder as read_folder
    from .table import Remark as Remark
    from .video import Tracks as Tracks
    from .writing import Entry as Entry
    from .writing import added as added
    from .writing import csv_text as csv_text
    from .writing import file_stem as file_stem
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
