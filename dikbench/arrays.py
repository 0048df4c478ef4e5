"""The one array type: double precision, any shape (shapes stand in the docstrings)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


def plain(array: Array) -> Array:
    """Return the array, or a copy of one that is read-only, strided or column-major.

    Some libraries take no such array, others take it for a plain one.
    """
    return array if array.flags.carray else np.array(array, order="C")


def read_only(array: Array) -> Array:
    """Forbid writing to an array, and return it."""
    array.setflags(write=False)  # half the time of array.flags.writeable = False
    return array
