"""Residuals of answers, recomputed from their programs."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.solvers.recheck.stack import Stack


class Residuals:
    """Residuals of k answers, (k,) each.

    Attributes:
        primal: largest violation of an equality, inequality or bound [rad/s or m/s].
        dual: largest entry of P x + q + G^T z + A^T y + z_box, and largest multiplier of the wrong
            sign, over max(1, largest entry of P), a gradient of the cost; NaN where the interface
            gives no multipliers.
        gap: |x^T P x + q^T x + h^T z + b^T y + ub^T z_box+ + lb^T z_box-|, on the same scale.
        nearness: a bound on the distance from the optimum that follows from them to first order
            (see `optimum`): max |x - x*| [rad/s] where P is positive definite, the difference in
            cost elsewhere; infinite where nothing follows.
        explained: whether there are multipliers, from which dual and gap follow.
    """

    __slots__ = ("dual", "explained", "gap", "nearness", "primal")

    def __init__(
        self, primal: Array, dual: Array, gap: Array, nearness: Array, *, explained: bool
    ) -> None:
        self.explained = explained
        self.primal = primal
        self.dual = dual
        self.gap = gap
        self.nearness = nearness

    def within(self, tolerance: float) -> Mask:
        """Say whether every residual that is known is within a tolerance, (k,); NaN is not."""
        good: Mask = self.primal <= tolerance
        if self.explained:
            good = good & (self.dual <= tolerance) & (self.gap <= tolerance)
        return good


def residuals(stack: Stack) -> Residuals:
    """Recompute the residuals of answers.

    An infinite bound constrains nothing; a multiplier of it counts as one of the wrong sign.
    """
    primal = _primal(stack)
    if not stack.explained:
        unknown = np.full(len(stack.x), np.nan)
        return Residuals(primal, unknown, unknown, np.full(len(stack.x), np.inf), explained=False)
    Px = np.einsum("kij,kj->ki", stack.P, stack.x)
    gradient = Px + stack.q
    gap = _dots(stack.x, gradient)
    wrong_sign = multiplier_sum = np.zeros(len(stack.x))
    if stack.A is not None and stack.b is not None and stack.y is not None:
        gradient = gradient + np.einsum("kij,ki->kj", stack.A, stack.y)
        gap = gap + _dots(stack.b, stack.y)
        multiplier_sum = multiplier_sum + np.abs(stack.y).sum(axis=1)
    for bound, multiplier in _one_sided(stack):
        gap = gap + _dots(np.where(np.isfinite(bound), bound, 0.0), multiplier)
        # An infinite bound cannot have a multiplier.
        invalid = np.where(np.isfinite(bound), 0.0, np.abs(multiplier)).max(axis=1, initial=0.0)
        wrong_sign = np.maximum(wrong_sign, invalid)
        multiplier_sum = multiplier_sum + np.abs(multiplier).sum(axis=1)
    if stack.z_box is not None:
        gradient = gradient + stack.z_box
    if stack.G is not None and stack.z is not None:
        gradient = gradient + np.einsum("kij,ki->kj", stack.G, stack.z)
        wrong_sign = np.maximum(wrong_sign, (-stack.z).max(axis=1, initial=0.0))
    scale = np.maximum(1.0, np.abs(stack.P).max(axis=(1, 2)))
    dual = np.maximum(np.abs(gradient).max(axis=1), wrong_sign)
    slack = np.abs(gap - _dots(stack.x, gradient)) + 2 * primal * multiplier_sum
    nearness = np.where(wrong_sign > 0, np.inf, _nearness(stack, gradient, slack))
    return Residuals(primal, dual / scale, np.abs(gap) / scale, nearness, explained=True)


def _one_sided(stack: Stack) -> list[tuple[Array, Array]]:
    """Pair the inequalities and bounds with their multipliers, (k, .) each."""
    pairs = []
    if stack.h is not None and stack.z is not None:
        pairs.append((stack.h, stack.z))
    if stack.z_box is not None:
        nothing = np.full_like(stack.x, np.inf)
        up, down = np.maximum(stack.z_box, 0.0), np.minimum(stack.z_box, 0.0)
        pairs.append((nothing if stack.ub is None else stack.ub, up))
        pairs.append((-nothing if stack.lb is None else stack.lb, down))
    return pairs


def _nearness(stack: Stack, gradient: Array, slack: Array) -> Array:
    """Bound the distance from the optimum, (k,).

    With r the residual gradient and s the slack, both unscaled:

    P positive definite:  mu |x - x*|^2 <= |x - x*| |r| + s,   mu its smallest eigenvalue
    otherwise:            cost - cost* <= |r|_1 max |x - x*| + s
    """
    definite = np.all(np.diagonal(stack.P, axis1=1, axis2=2) > 0, axis=1)
    bound = np.full(len(stack.x), np.inf)
    if definite.any():
        softness = _softness(stack.P[definite])
        size = np.linalg.norm(gradient[definite], axis=1)
        with np.errstate(invalid="ignore"):
            found = size * softness + np.sqrt(slack[definite] * softness)
        bound[definite] = np.where(np.isnan(found), np.inf, found)
    if not definite.all() and stack.lb is not None and stack.ub is not None:
        width = (stack.ub - stack.lb)[~definite].max(axis=1)
        size = np.abs(gradient[~definite]).sum(axis=1)
        with np.errstate(invalid="ignore"):
            found = size * width + slack[~definite]
        bound[~definite] = np.where(np.isnan(found), np.inf, found)
    return bound


def _softness(P: Array) -> Array:
    """Compute the Frobenius norms of the inverses of P (k, n, n): at least 1/mu each, (k,).

    mu is the smallest eigenvalue; infinite where a matrix is not positive definite. What others
    there are does not matter.
    """
    try:
        np.linalg.cholesky(P)
        softness: Array = np.linalg.norm(np.linalg.inv(P), axis=(1, 2))
        return softness
    except np.linalg.LinAlgError:  # one is not definite: the judge solves its program
        if len(P) == 1:
            return np.array([np.inf])
        return np.concatenate([_softness(one[None]) for one in P])


def _dots(a: Array, b: Array) -> Array:
    found: Array = np.einsum("ki,ki->k", a, b)
    return found


def _primal(stack: Stack) -> Array:
    x, worst = stack.x, np.zeros(len(stack.x))
    if stack.A is not None and stack.b is not None:
        off = np.abs(np.einsum("kij,kj->ki", stack.A, x) - stack.b)
        worst = off.max(axis=1, initial=0.0)
    if stack.G is not None and stack.h is not None:
        excess = np.einsum("kij,kj->ki", stack.G, x) - stack.h
        worst = np.maximum(worst, excess.max(axis=1, initial=0.0))
    if stack.lb is not None:
        worst = np.maximum(worst, (stack.lb - x).max(axis=1))
    if stack.ub is not None:
        worst = np.maximum(worst, (x - stack.ub).max(axis=1))
    return worst
