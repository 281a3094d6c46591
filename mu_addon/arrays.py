"""The type of a numpy array in signatures; its shape and unit stand in each docstring."""

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]
