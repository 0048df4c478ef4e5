"""The array types: double precision, indices and masks; docstrings state the shapes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


def plain(array: Array) -> Array:
    """Return the array, or a copy of one that is read-only, strided or column-major.

    Some libraries refuse such an array, others read it as a contiguous one.
    """
    return array if array.flags.carray else np.array(array, order="C")


def read_only(array: Array) -> Array:
    """Forbid writing to an array, and return it."""
    array.setflags(write=False)  # half the time of array.flags.writeable = False
    return array
