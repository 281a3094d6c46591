"""Measured data: a folder of experiments (`experiments.toml` and CSV files), read and checked.

`read_folder` gives a `Measured` with its experiments in the order in which they were made; a fault in a file
raises an InputError with file, row and remedy.
"""

from typing import TYPE_CHECKING

from ..lazy import public_face

if TYPE_CHECKING:
    from .bench import Bench, Filmed, entry_of, filmed, pixels_text, read_bench, read_pressure
    from .experiment import Experiment
    from .folder import Measured, read_folder
    from .table import Remark
    from .video import Tracks
    from .writing import Entry, added, csv_text, file_stem
else:
    __getattr__, __dir__, __all__ = public_face(__name__)
