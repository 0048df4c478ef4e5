"""The gradients of the manipulability of many configurations at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dikbench.problem import Array, volume
from formulations.manipulability import PLANAR


def manipulability_gradients(J: Array, before: Sequence[int]) -> Array:
    """Compute `manipulability_gradient` (in `manipulability`) of many Jacobians at once, (N, nv).

        w_k . sum_(j<k) (a_j x v_j + b_j x w_j) + v_k . sum_(j<k) a_j x w_j

    times the manipulability, with (v; w)_k the columns of J and (a; b)_j those of (J^+)^T.

    Args:
        J: (N, 6, nv), or (N, 3, nv) of a planar arm.
        before: see there.
    """
    size = volume(J)
    gram = J @ J.transpose(0, 2, 1)
    regular = size > np.finfo(float).eps * np.trace(gram, axis1=1, axis2=2) ** (J.shape[1] / 2)
    inverse = np.zeros_like(J)
    inverse[regular] = np.linalg.solve(gram[regular], J[regular])
    (v, w), (a, b) = (_columns(part) for part in (J, inverse))
    turning, moving = np.cross(a, v) + np.cross(b, w), np.cross(a, w)
    sums = [np.cumsum(part, axis=1) for part in (turning, moving)]
    first = np.zeros((len(J), 1, 3))
    turning, moving = (np.concatenate([first, part], axis=1)[:, [*before]] for part in sums)
    gradients: Array = np.vecdot(w, turning) + np.vecdot(v, moving)
    return np.where(regular, size, 0.0)[:, None] * gradients


def _columns(J: Array) -> tuple[Array, Array]:
    """Split Jacobians into the linear and angular parts of their columns, (N, nv, 3) each."""
    if J.shape[1] == 3:
        spatial = np.zeros((len(J), 6, J.shape[2]))
        spatial[:, PLANAR] = J
        J = spatial
    columns = np.ascontiguousarray(J.transpose(0, 2, 1))
    return columns[:, :, :3], columns[:, :, 3:]
