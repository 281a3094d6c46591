"""Measured data: a folder of experiments, read and checked."""

from .experiment import Experiment
from .folder import Measured, read_folder
from .table import Remark

__all__ = ["Experiment", "Measured", "Remark", "read_folder"]
