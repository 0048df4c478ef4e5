"""The smallest of all singular values of a sequence of matrices, without computing most of them."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

SINGULAR_VALUE_STRIDE: Final = 16
"""The singular values of one matrix in this many are computed to begin with."""

SINGULAR_VALUE_ROUNDING: Final = 1e-6
"""How much rounding may change a small singular value (m, rad) when its matrix is squared."""


def smallest_of_all_singular_values(J: Array) -> float:
    """Compute the smallest singular value of all matrices of a sequence (k, m, n).

    A singular value changes by at most the norm of the change of its matrix (Weyl's inequality):
    those of a few matrices rule out most of the others, and a cheap bound most of the rest.
    """
    stride, numbers = SINGULAR_VALUE_STRIDE, np.arange(len(J))
    nearest = np.minimum(numbers - numbers % stride + stride // 2, len(J) - 1)
    sampled = np.unique(nearest)
    values = np.linalg.svd(J[sampled], compute_uv=False)[:, -1]
    least = float(values.min())
    changes = np.diff(J, axis=0).reshape(len(J) - 1, J[0].size)
    path = np.concatenate([[0.0], np.cumsum(np.sqrt(np.einsum("ki,ki->k", changes, changes)))])
    bound = values[np.searchsorted(sampled, nearest)] - np.abs(path - path[nearest])
    possible = J[bound < least]
    if not len(possible):
        return least
    candidates = possible[_singular_value_floor(possible) <= least + SINGULAR_VALUE_ROUNDING]
    return float(np.linalg.svd(candidates, compute_uv=False)[:, -1].min(initial=least))


def _singular_value_floor(J: Array) -> Array:
    """Compute a lower bound on the smallest singular value of each J (k, m, n), but for rounding.

    1/sigma_min^2 is the largest eigenvalue of (J J^T)^-1 and thus at most its Frobenius norm; that
    costs a quarter of what the singular values cost.
    """
    wide = J if J.shape[1] <= J.shape[2] else J.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(wide @ wide.transpose(0, 2, 1))
    except np.linalg.LinAlgError:  # one of them is singular to the last bit
        return np.zeros(len(J))
    floor: Array = 1 / np.sqrt(np.linalg.norm(inverse, axis=(1, 2)))
    return floor
