"""Dense factorisations of the size of a robot arm, through LAPACK without numpy's wrappers."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dgesdd, dposv

from dikbench.array import Array


def pseudo_inverse(A: Array, tolerance: float) -> Array:
    """Moore-Penrose inverse (n, m) of A (m, n), singular values up to `tolerance` taken as zero.

    The tolerance is absolute, in the units of A: a relative one blows up where A itself vanishes.
    """
    U, singular, Vt, _ = dgesdd(A, full_matrices=0)
    kept = singular > tolerance
    inverse = np.zeros_like(singular)
    inverse[kept] = 1.0 / singular[kept]
    result: Array = (Vt.T * inverse) @ U.T
    return result


@lru_cache(maxsize=64)
def scaled_identity(n: int, scale: float) -> Array:
    """The matrix scale I, (n, n), made once: to be read, not written to."""
    matrix: Array = np.eye(n) * scale
    matrix.flags.writeable = False
    return matrix


def solve_positive_definite(A: Array, b: Array) -> Array | None:
    """X with A x = b for a symmetric positive definite A (n, n); None where A is not."""
    _, x, info = dposv(A, b)
    return x if info == 0 else None


def inverse_and_row_space(A: Array, tolerance: float, damping: float = 0.0) -> tuple[Array, Array]:
    """The (damped) inverse (n, m) of A (m, n), and an orthonormal basis (r, n) of A's row space.

    Singular values s up to the (absolute) tolerance count as zero, r are above it; their inverse is
    s / (s^2 + damping^2). I - basis^T basis projects onto the null space of A, damped or not.
    """
    U, singular, Vt, _ = dgesdd(A, full_matrices=0)
    rank = int((singular > tolerance).sum())
    kept, basis = singular[:rank], Vt[:rank]
    inverse: Array = (basis.T * (kept / (kept * kept + damping * damping))) @ U[:, :rank].T
    return inverse, basis
