"""Exponentials of many rotation vectors and twists at once."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

SMALL: Final = 1e-3
"""Square of an angle [rad^2] below which series are exact to rounding."""


def exp3(vectors: Array) -> Array:
    """Compute the rotations (n, 3, 3) of rotation vectors (n, 3) [rad]."""
    return _rotations(vectors, *_coefficients(vectors)[:3])


def exp6(twists: Array) -> tuple[Array, Array]:
    """Compute rotations (n, 3, 3) and translations (n, 3) of twists (n, 6) (linear; angular)."""
    v, w = twists[:, :3], twists[:, 3:]
    square, a, b, c = (each[:, None] for each in _coefficients(w))
    (x, y, z), (i, j, k) = w.T, v.T
    across = np.stack([y * k - z * j, z * i - x * k, x * j - y * i], axis=1)
    along = c * (x * i + y * j + z * k)[:, None]
    return _rotations(w, square[:, 0], a[:, 0], b[:, 0]), a * v + b * across + along * w


def _rotations(vectors: Array, square: Array, a: Array, b: Array) -> Array:
    """Compute I + a [r] + b [r]^2, (n, 3, 3), of rotation vectors r (n, 3)."""
    rotations: Array = b[:, None, None] * (vectors[:, :, None] * vectors[:, None, :])
    x, y, z = (a[:, None] * vectors).T
    rotations[:, 2, 1] += x
    rotations[:, 1, 2] -= x
    rotations[:, 0, 2] += y
    rotations[:, 2, 0] -= y
    rotations[:, 1, 0] += z
    rotations[:, 0, 1] -= z
    rotations.reshape(-1, 9)[:, ::4] += (1 - b * square)[:, None]
    return rotations


def composed(
    rotation: Array, translation: Array, moved: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Compose one placement, or n, with n others.

    Args:
        rotation: (3, 3) or (n, 3, 3).
        translation: (3,) or (n, 3) [m].
        moved: rotations (n, 3, 3) and translations (n, 3) [m] seen from there.
    """
    rotations, translations = moved
    return rotation @ rotations, translation + (rotation @ translations[..., None])[..., 0]


def _coefficients(w: Array) -> tuple[Array, Array, Array, Array]:
    """Compute t^2, sin(t)/t, (1 - cos t)/t^2 and (1 - sin(t)/t)/t^2 of the norms t of (n, 3)."""
    square = np.einsum("ij,ij->i", w, w)
    small = square < SMALL
    safe = np.where(small, 1.0, square)
    t = np.sqrt(safe)
    half = np.sin(t / 2) / t
    s = square
    a = np.where(small, 1 - s / 6 * (1 - s / 20 * (1 - s / 42)), np.sin(t) / t)
    b = np.where(small, (1 - s / 12 * (1 - s / 30 * (1 - s / 56))) / 2, 2 * half**2)
    c = np.where(small, (1 - s / 20 * (1 - s / 42 * (1 - s / 72))) / 6, (1 - a) / safe)
    return square, a, b, c
