"""Progress and direction error of an achieved twist against a desired one, in one metric."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

CHARACTERISTIC_LENGTH_M: Final = 0.2
"""L, which weighs angular rows: M = diag(1, 1, 1, L^2, L^2, L^2)."""

DWELL_SPEED_M_S: Final = 1e-4
"""A step with a smaller |V|_M is a dwell: no motion is desired, and V has no direction."""

STUCK_PROGRESS: Final = 0.01
"""A step that achieves a smaller share of the desired motion is stuck."""

STANDSTILL_SPEED_SHARE: Final = 1e-6
"""With a smaller share of |V|_M the robot stands still, and its motion has no direction."""


def row_weights(rows: tuple[int, ...], length: float = CHARACTERISTIC_LENGTH_M) -> Array:
    """Return the square roots of M's diagonal for the rows of a twist that a task keeps, (m,)."""
    return np.array([1.0 if row < 3 else length for row in rows])


def progress(desired: Array, achieved: Array, weights: Array) -> Array:
    """Compute alpha = <V_a, V>_M / |V|_M^2 of each step, (n,); NaN in a dwell, < 0 in reverse.

    Args:
        desired: V, (n, m) [m/s; rad/s].
        achieved: V_a = J v, (n, m).
        weights: square roots of M's diagonal, (m,).
    """
    V, V_a = desired * weights, achieved * weights
    size = np.einsum("ij,ij->i", V, V)
    moving = size >= DWELL_SPEED_M_S**2
    return np.where(moving, np.einsum("ij,ij->i", V_a, V) / np.where(moving, size, 1.0), np.nan)


def off_course(desired: Array, achieved: Array, weights: Array) -> Array:
    """Compute the angle between the achieved and the desired twist, (n,) [rad].

    NaN in a dwell and where the robot stands still. It is acos(<V_a, V>_M / (|V_a|_M |V|_M)),
    computed as atan2 of the part across and the part along, which is exact for small angles.
    """
    V, V_a = desired * weights, achieved * weights
    size, size_a = np.linalg.norm(V, axis=1), np.linalg.norm(V_a, axis=1)
    defined = (size >= DWELL_SPEED_M_S) & (size_a >= STANDSTILL_SPEED_SHARE * size)
    direction = V / np.where(defined, size, 1.0)[:, None]
    along = np.einsum("ij,ij->i", V_a, direction)
    across = np.linalg.norm(V_a - along[:, None] * direction, axis=1)
    return np.where(defined, np.arctan2(across, along), np.nan)
