"""The smallest singular value that a sequence of Jacobians comes to."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

SINGULAR_VALUE_STRIDE: Final = 32
"""The singular values of one matrix in so many are computed in any case."""

BLUR: Final = 1e-6
"""How much rounding may change a small singular value (m, rad) when its matrix is squared."""


def smallest_singular_value(J: Array) -> float:
    """Compute the smallest singular value that a sequence of matrices (k, m, n) comes to.

    It changes by at most the norm of the change of its matrix (Weyl): the values of a few matrices
    exclude most others, and a lower bound that takes a quarter of the time excludes most of these.
    """
    steps = np.arange(len(J))
    group = steps // SINGULAR_VALUE_STRIDE
    middle = np.minimum(group * SINGULAR_VALUE_STRIDE + SINGULAR_VALUE_STRIDE // 2, len(J) - 1)
    values = np.linalg.svd(J[np.unique(middle)], compute_uv=False)[:, -1]
    changes = np.diff(J, axis=0).reshape(len(J) - 1, J[0].size)
    way = np.append(0.0, np.cumsum(np.sqrt(np.einsum("ki,ki->k", changes, changes))))
    open_ = J[values[group] - np.abs(way - way[middle]) < values.min()]
    open_ = open_[_singular_value_floor(open_) < values.min() + BLUR]
    return float(np.linalg.svd(open_, compute_uv=False)[:, -1].min(initial=values.min()))


def _singular_value_floor(J: Array) -> Array:
    """Compute what the smallest singular value of each J (k, m, n) is not below, but for `BLUR`.

    1/sigma_min^2 is the largest eigenvalue of (J J^T)^-1 and thus at most its Frobenius norm.
    """
    wide = J if J.shape[1] <= J.shape[2] else J.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(wide @ wide.transpose(0, 2, 1))
    except np.linalg.LinAlgError:  # one of them is singular
        return np.zeros(len(J))
    floor: Array = 1 / np.sqrt(np.linalg.norm(inverse, axis=(1, 2)))
    return floor
