"""Dense linear algebra of small matrices, through LAPACK without numpy's wrappers.

Where a formulation is asked for many control steps at once (see `Formulation`), matrices and
vectors have an axis of rows in front, (N, m, n) and (N, m), and functions that say so take both:
this is the only module that knows of the two. A row's result does not depend on the others, to the
bit. NumPy raises `LinAlgError` for all rows where one has no result.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import prod
from typing import Any, Literal

import numpy as np
from scipy.linalg.lapack import dgeqrf, dgesdd, dpocon, dposv

from dikbench.arrays import Array, Mask

Projector = Literal["exact", "damped"]

LEAST_CONDITION = 1e-8
"""A Gram matrix is ill-conditioned where the reciprocal of its condition number is smaller: half of
the digits are lost."""


WELL_CONDITIONED = 1e-6
"""Reciprocal condition of a Gram matrix from which on it is solved where a row is one of many: the
singular values of a matrix take ten times as long."""

REGULAR = 1e-14
"""Reciprocal condition from which on a matrix counts as regular."""


def thin_svd(A: Array) -> tuple[Array, Array, Array]:
    """Compute U (m, k), falling singular values (k,) and V^T (k, n) of A (m, n), k = min(m, n)."""
    return _svd(A, 0)


def _svd(A: Array, full: int) -> tuple[Array, Array, Array]:
    """Decompose A by LAPACK; NaN where there is no decomposition, as of a matrix with NaN."""
    finite = np.vdot(A, A) < np.inf or np.isfinite(A).all()
    # Of NaN LAPACK leaves zeros behind, which would pass for an answer; of infinity it never ends.
    U, singular, Vt, failed = dgesdd(A if finite else np.zeros_like(A), full_matrices=full)
    if failed or not finite:
        for part in (U, singular, Vt):
            part.fill(np.nan)
    return U, singular, Vt


def transposed(A: Array) -> Array:
    """Transpose A (m, n) or (N, m, n)."""
    return A.T if A.ndim == 2 else A.transpose(0, 2, 1)


def product(A: Array, B: Array) -> Array:
    """Compute A B of (m, k) and (k, n), with or without rows in front of either."""
    matrix: Array = A.dot(B) if A.ndim == B.ndim == 2 else A @ B
    return matrix


def times(A: Array, x: Array) -> Array:
    """Compute A x of A (m, n) and x (n,), with or without rows in front of either."""
    vector: Array = A.dot(x) if x.ndim == 1 and A.ndim == 2 else np.matvec(A, x)
    return vector


def dot(x: Array, y: Array) -> Array:
    """Compute x^T y of (n,) or (N, n): a number, or (N,)."""
    value: Array = x.dot(y) if x.ndim == 1 else np.vecdot(x, y)
    return value


def divided(a: Array, b: Array, where: Mask) -> Array:
    """Compute a / b where a condition holds, element by element, and 0 elsewhere."""
    share: Array = np.divide(a, b, out=np.zeros(np.broadcast(a, b).shape), where=where)
    return share


def by_singular_values(A: Array, b: Array, shares: Callable[[Array, Array], Array]) -> Array:
    """Compute sum_i s_i v_i of A = sum_i sigma_i u_i v_i^T (m, n) or (N, m, n).

    Args:
        A: the matrix, or one per row.
        b: (m,) or (N, m).
        shares: (sigma (..., k) falling, u_i . b (..., k)) -> s (..., k).
    """
    if A.ndim == 2:
        U, singular, Vt = thin_svd(A)
        vector: Array = shares(singular, b.dot(U)).dot(Vt)
        return vector
    U, singular, Vt = np.linalg.svd(A, full_matrices=False)
    many: Array = np.vecmat(shares(singular, np.vecmat(b, U)), Vt)
    return many


def rank(singular: Array, tolerance: float) -> int:
    """Count the falling singular values (k,) above a tolerance; NaN counts as above."""
    return len(singular) - int(np.count_nonzero(singular <= tolerance))


def pseudo_inverse(A: Array, tolerance: float) -> Array:
    """Compute the Moore-Penrose inverse (n, m) of A (m, n).

    Singular values up to `tolerance` count as zero. It is absolute, in the units of A: the inverse
    of a relative one grows without bound where A itself vanishes.
    """
    U, singular, Vt = thin_svd(A)
    k = rank(singular, tolerance)
    result: Array = (Vt[:k].T / singular[:k]) @ U[:, :k].T
    return result


def least_norm(A: Array, b: Array, tolerance: float) -> Array:
    """Compute the shortest least-squares solution (n,) of A x = b: `pseudo_inverse` times b.

    Of many (N, m, n) and (N, m) as well, (N, n).
    """
    if A.ndim == 3:
        return _least_norm_of_many(A, b, tolerance)
    U, singular, Vt = thin_svd(A)
    k = rank(singular, tolerance)
    x: Array = (b.dot(U[:, :k]) / singular[:k]).dot(Vt[:k])
    return x


def damped_least_squares(A: Array, b: Array, squared_damping: float | Array) -> Array:
    """Compute the minimiser (n,) of ||A x - b||^2 + lambda^2 ||x||^2 for A (m, n), b (m,).

    The smaller of the two Gram matrices is factorised: A A^T where the rows are fewer, else A^T A.
    Where that would lose more than half of the digits (at a singularity with hardly any damping)
    the singular values are used instead. Where rank is lost without damping this is the shortest
    minimiser. Of many (N, m, n) and (N, m) as well, (N, n), with one damping or (N,).
    """
    if A.ndim == 3:
        return _damped_least_squares_of_many(A, b, np.broadcast_to(squared_damping, len(A)))
    m, n = A.shape
    damped = A.dot(A.T) if m <= n else A.T.dot(A)
    damped.flat[:: len(damped) + 1] += squared_damping
    trace, size = float(damped.trace()), len(damped)
    factor, y, info = dposv(damped, b if m <= n else b.dot(A))
    # The smallest eigenvalue is at least det ((size - 1)/trace)^(size - 1): the geometric mean of
    # the others is at most their arithmetic one.
    determinant = prod(factor.diagonal().tolist()) ** 2
    surely = determinant * (size - 1) ** (size - 1) >= LEAST_CONDITION * trace**size
    if info or (not surely and dpocon(factor, trace)[0] < LEAST_CONDITION):
        lost = np.finfo(float).eps * max(m, n) * float(np.linalg.norm(A))
        return DampedInverse(A, lost, float(squared_damping) ** 0.5).times(b)
    x: Array = y.dot(A) if m <= n else y
    return x


def _least_norm_of_many(A: Array, b: Array, tolerance: float) -> Array:
    """Solve by the Gram matrix where its condition allows, else by singular values (N, n)."""
    gram, wide = _gram(A)
    trace = np.trace(gram, axis1=1, axis2=2)
    sure = _condition_floor(gram, trace) >= WELL_CONDITIONED
    # A singular value is at least sqrt(WELL_CONDITIONED trace) there.
    sure &= trace * WELL_CONDITIONED > tolerance**2
    x = np.empty((len(A), A.shape[2]))
    x[sure] = _refined(A[sure], b[sure], gram[sure], wide=wide)
    x[~sure] = by_singular_values(
        A[~sure], b[~sure], lambda sigma, parts: divided(parts, sigma, ~(sigma <= tolerance))
    )
    return x


def _damped_least_squares_of_many(A: Array, b: Array, squared_damping: Array) -> Array:
    """Solve by the Gram matrix where its condition allows, else one by one, (N, n)."""
    gram, wide = _gram(A)
    size = gram.shape[1]
    gram[:, range(size), range(size)] += squared_damping[:, None]
    trace = np.trace(gram, axis1=1, axis2=2)
    sure = _condition_floor(gram, trace) >= LEAST_CONDITION
    x = np.empty((len(A), A.shape[2]))
    x[sure] = _by_gram(A[sure], b[sure], gram[sure], wide=wide)
    for k in np.flatnonzero(~sure).tolist():
        x[k] = damped_least_squares(A[k], b[k], float(squared_damping[k]))
    return x


def inverse_of_many(A: Array) -> tuple[Array, Mask]:
    """Compute the inverses of symmetric matrices (N, n, n), and which are well-conditioned, (N,).

    NaN where one is singular.
    """
    sure = _condition_floor(A, np.trace(A, axis1=1, axis2=2)) >= REGULAR
    inverse = np.full_like(A, np.nan)
    inverse[sure] = np.linalg.inv(A[sure])
    return inverse, sure


def shortest_of_many(A: Array, b: Array) -> tuple[Array, Array, Mask]:
    """Solve A x = b for A (N, m, n), m <= n, and b (N, m) by the shortest x = A^T w.

    Returns:
        x (N, n), w (N, m), NaN where A is ill-conditioned, and where it is not, (N,).
    """
    gram = A @ A.transpose(0, 2, 1)
    sure = _condition_floor(gram, np.trace(gram, axis1=1, axis2=2)) >= LEAST_CONDITION
    w = np.full_like(b, np.nan)
    w[sure] = np.linalg.solve(gram[sure], b[sure][..., None])[..., 0]
    return np.vecmat(w, A), w, sure


def _gram(A: Array) -> tuple[Array, bool]:
    """Compute A A^T where the rows are not more than the columns, else A^T A; and whether."""
    wide = A.shape[1] <= A.shape[2]
    At = A.transpose(0, 2, 1)
    return (A @ At if wide else At @ A), wide


def _condition_floor(gram: Array, trace: Array) -> Array:
    """Compute what the reciprocal conditions of matrices (N, k, k) are not below, (N,).

    See `damped_least_squares`.
    """
    size = gram.shape[1]
    determinant = np.linalg.det(gram)
    floor: Array = divided(determinant * (size - 1) ** (size - 1), trace**size, trace > 0)
    return floor


def _by_gram(A: Array, b: Array, gram: Array, *, wide: bool) -> Array:
    """Compute A^T gram^-1 b, or gram^-1 A^T b, (N, n)."""
    if wide:
        y = np.linalg.solve(gram, b[..., None])[..., 0]
        x: Array = np.vecmat(y, A)
        return x
    x = np.linalg.solve(gram, np.vecmat(b, A)[..., None])[..., 0]
    return x


def _refined(A: Array, b: Array, gram: Array, *, wide: bool) -> Array:
    """Compute A^T gram^-1 b, or gram^-1 A^T b, and once more for what is left of b, (N, n).

    It has then as many digits as the singular values give.
    """
    inverse: Any = np.linalg.inv(gram)
    At = A.transpose(0, 2, 1)
    x = np.zeros((len(A), A.shape[2]))
    for _ in range(2):
        left = b - times(A, x)
        x = x + (times(At, times(inverse, left)) if wide else times(inverse, times(At, left)))
    return x


@lru_cache(maxsize=64)
def scaled_identity(n: int, scale: float) -> Array:
    """Return the matrix scale I, (n, n), made once and read-only."""
    matrix: Array = np.eye(n) * scale
    matrix.flags.writeable = False
    return matrix


def solve_positive_definite(A: Array, b: Array) -> Array | None:
    """Solve A x = b for a symmetric positive definite A (n, n); None where A is not."""
    _, x, info = dposv(A, b)
    return x if info == 0 else None


def null_space(A: Array, tolerance: float) -> Array:
    """Compute an orthonormal basis of the null space of A (m, n), columns (n, n - rank).

    Singular values up to `tolerance` (absolute, in the units of A) count as zero.
    """
    _, singular, Vt = _svd(A, 1)
    basis: Array = Vt[rank(singular, tolerance) :].T
    return basis


class DampedInverse:
    """A^# = A^T (A A^T + lambda^2 I)^-1, (n, m), of a matrix A (m, n), by its singular values.

    Singular values up to `tolerance` (absolute, in the units of A) count as zero. Without damping
    it is the Moore-Penrose inverse A^+.
    """

    __slots__ = ("_U", "_Vt", "_damped", "_kept", "_singular")

    def __init__(self, A: Array, tolerance: float, damping: float) -> None:
        self._U, self._singular, self._Vt = _svd(A, 0)
        self._kept = self._singular > tolerance
        self._damped = self._singular**2 + damping**2

    def times(self, b: Array) -> Array:
        """Compute A^# b, (n,)."""
        gain = np.divide(
            self._singular, self._damped, out=np.zeros_like(self._damped), where=self._kept
        )
        x: Array = (gain * b.dot(self._U)).dot(self._Vt)
        return x

    def taken(self, projector: Projector) -> Array:
        """Compute the part of the velocity space that A uses, (n, n); I minus it is left free.

        Args:
            projector: "exact" for A^+ A, the orthogonal projector onto the row space of A; "damped"
                for A^# A, which is not a projector when lambda > 0.
        """
        if projector == "exact":
            share = self._kept.astype(float)
        else:
            share = np.divide(
                self._singular**2, self._damped, out=np.zeros_like(self._damped), where=self._kept
            )
        matrix: Array = (self._Vt.T * share).dot(self._Vt)
        return matrix


def inverse_and_row_space(A: Array, tolerance: float, damping: float = 0.0) -> tuple[Array, Array]:
    """Compute the (damped) inverse (n, m) of A (m, n) and an orthonormal row basis (r, n).

    The r singular values s above the (absolute) tolerance have the inverse s / (s^2 + damping^2),
    the others count as zero. I - basis^T basis projects onto the null space of A.
    """
    U, singular, Vt = _svd(A, 0)
    k = rank(singular, tolerance)
    kept, basis = singular[:k], Vt[:k]
    inverse: Array = (basis.T * (kept / (kept * kept + damping * damping))) @ U[:, :k].T
    return inverse, basis


def volume(A: Array) -> float | Array:
    """Compute sqrt(det(A A^T)) of A (m, n), the product of its singular values if m <= n.

    It is computed from R of A^T = Q R, since a Gram matrix would lose half of the digits. Of many
    (N, m, n) as well, (N,).
    """
    m, n = A.shape[-2:]
    if m > n:
        return 0.0
    if A.ndim == 3:
        many: Any = np.linalg.qr(A.transpose(0, 2, 1), mode="r")
        volumes: Array = np.abs(np.prod(np.diagonal(many, axis1=1, axis2=2), axis=1))
        return volumes
    R, _, _, _ = dgeqrf(A.T)
    return float(abs(R.diagonal().prod()))
