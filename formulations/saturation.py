"""Saturation in the null space, level by level: the part that the laws of its family share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from dikbench.errors import Infeasible
from dikbench.problem import (
    Array,
    Box,
    DikProblem,
    inverse_and_row_space,
    solve_positive_definite,
)

SMALLEST_SQUARED_FREEDOM = 1e-6
"""Square of the smallest free share of a joint's velocity with which it is saturated: rounding
grows by its inverse, and must stay below 1e-9 in the levels above."""

MULTIPLIER_ROUNDING_RAD_S = 1e-10
"""Magnitude of a multiplier below which its sign is not reliable."""

NEGLIGIBLE_SPEED_RAD_S = 1e-100
"""A smaller speed counts as zero, so that quotients by it are finite."""


class _Held(NamedTuple):
    """The motion that is left with some joints saturated.

    Attributes:
        base: the least motion from the start with these joints at their bounds, (nv,).
        free: projector onto the motions that move none of these joints, (nv, nv).
        effect: change of `base` per unit of each bound, (nv, number of saturated joints).
    """

    base: Array
    free: Array
    effect: Array


class _Found(NamedTuple):
    """What came of a level.

    Attributes:
        velocity: a s + b, but for rounding, (nv,).
        scale: s, at most 1.
        a: change of the velocity per unit of s with these joints held, (nv,).
        b: velocity at s = 0 with these joints held, (nv,).
        held: the joints.
    """

    velocity: Array
    scale: float
    a: Array
    b: Array
    held: tuple[int, ...]

    def reach(self, box: Box) -> float:
        """Compute the largest scale, above 1 as well, for which the held joints are enough."""
        if self.scale < 1:
            return self.scale
        moves = np.abs(self.a) > NEGLIGIBLE_SPEED_RAD_S
        moves[list(self.held)] = False
        room = np.where(self.a > 0, box.upper, box.lower) - self.b
        return float((room[moves] / self.a[moves]).min(initial=np.inf))


def saturated_levels(
    problem: DikProblem,
    box: Box,
    rank_tolerance: float,
    *,
    optimal: bool,
    scale_margin: float = 1.0,
) -> Array:
    """Do every priority level in the null space of those above, inside the box.

    Where the box excludes rest, as under acceleration limits in motion, the least velocity may have
    too many joints outside the box; then the least change of velocity is tried. A level that
    reaches a scale s with s `scale_margin` < 1 is done again, scaled by that product.

    Raises:
        Infeasible: if no scale of the first task was found that fits the box.
    """
    v, N = np.zeros(problem.robot.nv), np.eye(problem.robot.nv)
    levels = problem.levels
    for number, level in enumerate(levels):
        start = v
        found = _saturated(level.J, level.V, start, N, box, rank_tolerance, optimal=optimal)
        if found is None and number == 0 and problem.v_prev is not None:
            start = inside(problem.v_prev, box)
            found = _saturated(level.J, level.V, start, N, box, rank_tolerance, optimal=optimal)
        if found is not None and scale_margin < 1:
            scale = scale_margin * found.reach(box)
            if 0 < scale < 1:
                V = scale * level.V
                again = _saturated(level.J, V, start, N, box, rank_tolerance, optimal=optimal)
                found = again or found
        if found is not None:
            v = found.velocity
        elif number == 0:
            raise Infeasible("saturation in the null space: no scale of the task fits the box")
        if number + 1 < len(levels):
            _, rows = inverse_and_row_space(level.J @ N, rank_tolerance)
            N = N - rows.T @ rows
    return v


def _saturated(
    J: Array, V: Array, start: Array, N: Array, box: Box, tolerance: float, *, optimal: bool
) -> _Found | None:
    """Find the velocity of one level from `start` in the range of the projector N, or None."""
    bounds: dict[int, float] = {}  # of the saturated joints
    rank = None
    best: _Found | None = None
    for _ in range(2 * len(start) + 1):  # freeing joints may cycle
        held = _hold(bounds, start, N)
        if held is None:
            break
        inverse, rows = inverse_and_row_space(J @ held.free, tolerance)
        rank = len(rows) if rank is None else rank
        if len(rows) < rank:
            break
        a = inverse @ V
        b = held.base - inverse @ (J @ held.base)
        scale, critical = fitting_scale(a, b, box, bounds)
        if scale > (-1.0 if best is None else best.scale):
            best = _Found(inside(b + scale * a, box), scale, a, b, (*bounds,))
        if optimal and scale >= 0:
            moved = b + scale * a - start  # by this level
            wrong = _wrong_side(moved, held.effect, inverse @ J, box, bounds)
            for joint in wrong:
                del bounds[joint]
            if wrong:
                continue
        if critical is None:
            return _Found(inside(a + b, box), 1.0, a, b, (*bounds,))
        if held.free[critical, critical] <= SMALLEST_SQUARED_FREEDOM:
            break
        outwards = a[critical] + b[critical] > box.upper[critical]
        bounds[critical] = float((box.upper if outwards else box.lower)[critical])
    return best


def inside(v: Array, box: Box) -> Array:
    """Clip rounding errors to the box (nv,); faster than `np.clip`."""
    held: Array = np.minimum(np.maximum(v, box.lower), box.upper)
    return held


def _hold(bounds: dict[int, float], start: Array, N: Array) -> _Held | None:
    """Hold joints at their bounds by least motion in the range of N; None if impossible."""
    if not bounds:
        return _Held(start, N, np.empty((len(start), 0)))
    joints = list(bounds)
    rows = N[joints]
    solved = solve_positive_definite(rows[:, joints], rows)
    if solved is None:
        return None
    effect = solved.T
    gap = np.array([*bounds.values()]) - start[joints]
    return _Held(start + effect @ gap, N - effect @ rows, effect)


def fitting_scale(a: Array, b: Array, box: Box, bounds: Iterable[int]) -> tuple[float, int | None]:
    """Compute the largest scale s <= 1 with a s + b in the box, and the joint to hold next.

    The scale is -1 where no scale s >= 0 fits. The joint is, among those outside at s = 1, the one
    with the smallest scale; None where none is outside.
    """
    v = a + b
    outside = (v < box.lower) | (v > box.upper)
    saturated = list(bounds)
    outside[saturated] = False
    if not outside.any():
        return 1.0, None
    moves = np.abs(a) > NEGLIGIBLE_SPEED_RAD_S
    inside = (box.lower <= b) & (b <= box.upper)
    low, high = np.where(inside, -np.inf, np.inf), np.where(inside, np.inf, -np.inf)
    np.divide(np.where(a > 0, box.lower, box.upper) - b, a, out=low, where=moves)
    np.divide(np.where(a > 0, box.upper, box.lower) - b, a, out=high, where=moves)
    low[saturated], high[saturated] = -np.inf, np.inf
    most = min(1.0, float(high.min()))
    scale = most if most >= max(0.0, float(low.max())) else -1.0
    return scale, int(np.argmin(np.where(outside, high, np.inf)))


def _wrong_side(
    v: Array, effect: Array, done: Array, box: Box, bounds: dict[int, float]
) -> list[int]:
    """List the held joints whose coming off the bound would make the motion smaller.

    The multiplier of a bound in min 1/2 ||v||^2 is the derivative of ||v||^2/2 by the bound.
    """
    slope = (effect - done @ effect).T @ v
    return [
        joint
        for joint, rate in zip(bounds, slope, strict=True)
        if (bounds[joint] < box.upper[joint] and rate < -MULTIPLIER_ROUNDING_RAD_S)
        or (bounds[joint] > box.lower[joint] and rate > MULTIPLIER_ROUNDING_RAD_S)
    ]
