"""Minimisers of many programs that keep every bound without being asked to."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.linear_algebra import inverse_of_many, shortest_of_many, times, transposed
from dikbench.programs.quadratic_program import QuadraticProgram

RESIDUAL = 1e-9
"""Largest violation of an equality [rad/s or m/s] and largest gradient of an answer."""


class Guess(NamedTuple):
    """Points that may be the minimisers of N programs, and their residuals (see `Residuals`).

    Attributes:
        x: (N, n).
        minimal: whether a point is the minimiser: it fulfils the conditions of Karush, Kuhn and
            Tucker to `RESIDUAL`, (N,).
        primal, dual, gap, distance: (N,) each.
    """

    x: Array
    minimal: Mask
    primal: Array
    dual: Array
    gap: Array
    distance: Array


def guessed(program: QuadraticProgram, count: int) -> Guess | None:
    """Guess the minimisers of N programs posed at once; None where nothing is known of them.

    Without equalities it is x = -P^-1 q, P being positive definite. With them, and a cost
    rho/2 ||x_I||^2 of the variables I that the linear cost does not push: those that it pushes are
    at their bounds, x_I is the shortest that does A x = b, and the multipliers are
    y = -rho (A_I A_I^T)^-1 (b - A_F x_F).
    """
    if program.G is not None:
        return None
    with np.errstate(all="ignore"):  # rows may be singular or not finite: they are no minimisers
        return _free(program, count) if program.A is None else _pushed(program, count)


def _free(program: QuadraticProgram, count: int) -> Guess | None:
    P, q = program.P, np.broadcast_to(program.q, (count, program.q.shape[-1]))
    if P.ndim == 2:
        return None
    inverse, sure = inverse_of_many(P)
    x = -times(inverse, q)
    gradient = times(P, x) + q
    size = np.abs(gradient).max(axis=1)
    softness = np.sqrt(np.einsum("kij,kij->k", inverse, inverse))
    scale = np.maximum(1.0, np.abs(P).max(axis=(1, 2)))
    gap = np.abs(np.vecdot(x, gradient)) / scale
    distance = np.sqrt(np.vecdot(gradient, gradient)) * softness
    minimal = sure & _inside(program, x) & (size <= RESIDUAL)
    return Guess(x, minimal, np.zeros(count), size / scale, gap, distance)


def _pushed(program: QuadraticProgram, count: int) -> Guess | None:
    P, q, A, b = program.P, program.q, program.A, program.b
    lower, upper = program.lb, program.ub
    assert A is not None
    assert b is not None
    if P.ndim != 2 or q.ndim != 1 or A.ndim != 3 or lower is None or upper is None:
        return None
    free = q == 0
    rho = P[free][:, free]
    if not free.any() or (P != np.diag(np.diag(P))).any() or (np.diag(rho) != rho[0, 0]).any():
        return None
    x = np.array(np.broadcast_to(np.where(q < 0, upper, lower), (count, len(q))))
    x[:, free] = 0.0
    bounded = np.isfinite(x).all(axis=1)
    x[:, free], w, sure = shortest_of_many(A[:, :, free], b - times(A, x))
    y = -rho[0, 0] * w
    gradient = times(P, x) + q + times(transposed(A), y)
    z = np.where(free, 0.0, -gradient)
    primal = np.abs(times(A, x) - b).max(axis=1)
    dual = np.abs(np.where(free, gradient, 0.0)).max(axis=1)
    right_sign = (np.where(free, 0.0, z * -np.sign(q)) >= 0).all(axis=1)
    gap = np.abs(np.vecdot(x, times(P, x) + q + z) + np.vecdot(np.broadcast_to(b, y.shape), y))
    distance = dual * np.max(upper - lower, axis=-1) + gap + 2 * primal * np.abs(y).sum(axis=1)
    minimal = sure & bounded & right_sign & _inside(program, x)
    minimal &= (primal <= RESIDUAL) & (dual <= RESIDUAL)
    return Guess(x, minimal, primal, dual, gap, distance)


def _inside(program: QuadraticProgram, x: Array) -> Mask:
    """Say which points keep the bounds, (N,)."""
    inside: Any = np.isfinite(x).all(axis=1)
    if program.lb is not None:
        inside &= (x >= program.lb).all(axis=1)
    if program.ub is not None:
        inside &= (x <= program.ub).all(axis=1)
    return inside  # type: ignore[no-any-return]
