"""Saturation in the null space, one task at a time: the loop that `sns` and `sns-optimal` share."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dikbench.array import Array
from dikbench.box import Box
from dikbench.errors import Infeasible
from dikbench.linear_algebra import inverse_and_row_space, solve_positive_definite
from dikbench.problem import DikProblem
from dikbench.tasks.task import LinearizedTask

FREEDOM = 1e-6
"""Square of the smallest share of a joint's velocity that must be free for it to be saturated:
rounding grows by the inverse of the square, and what is above must stay below 1e-9."""

ROUNDING = 1e-10
"""A multiplier [rad/s, or of the scale 1/(rad/s)] whose sign is not to be trusted."""

NEGLIGIBLE = 1e-100
"""A speed [rad/s] that is none: quotients by it stay finite."""


class _Motion(NamedTuple):
    """The motion v = s a + b that saturated joints leave to a level, by the scale s of its task.

    Attributes:
        a, b: (nv,).
        free: projector onto the motions that move none of the saturated joints, (nv, nv).
        effect: change of the least motion that has them at their bounds, without the task, per unit
            of each bound, (nv, number of saturated joints).
        J: the task's Jacobian, (m, nv).
        inverse: of what is free of it, (nv, m).
        rank: of what is free of it.
    """

    a: Array
    b: Array
    free: Array
    effect: Array
    J: Array
    inverse: Array
    rank: int

    @property
    def slope(self) -> Array:
        """Change of b per unit of each bound, (nv, number of saturated joints)."""
        slope: Array = self.effect - self.inverse @ (self.J @ self.effect)
        return slope


def saturated_levels(
    problem: DikProblem, box: Box, rank_tolerance: float, *, optimal: bool
) -> Array:
    """Every priority level in turn, each in the null space of those above, inside the box.

    Where the box excludes rest, as under acceleration limits in motion, the least velocity may have
    so many joints outside it that no saturation helps: then the least change of velocity.

    Raises:
        Infeasible: if no scale of the first task was found for which the box holds.
    """
    v, N = np.zeros(problem.robot.nv), np.eye(problem.robot.nv)
    levels = problem.levels
    for number, level in enumerate(levels):
        found = _saturated(level, v, N, box, rank_tolerance, optimal=optimal)
        if found is None and number == 0:
            before = v if problem.v_prev is None else problem.v_prev
            found = _saturated(level, _inside(before, box), N, box, rank_tolerance, optimal=optimal)
        if found is not None:
            v = found
        elif number == 0:
            raise Infeasible("saturation in the null space: no scale of the task fits the box")
        if number + 1 < len(levels):
            _, rows = inverse_and_row_space(level.J @ N, rank_tolerance)
            N = N - rows.T @ rows
    return v


def _saturated(
    level: LinearizedTask, start: Array, N: Array, box: Box, tolerance: float, *, optimal: bool
) -> Array | None:
    """The velocity of one level from `start` in the range of the projector N; None: none found."""
    bounds: dict[int, float] = {}  # of the saturated joints
    best, best_scale, vain, rank = None, -1.0, None, 0
    for _ in range(4 * len(start)):  # letting go of joints may go round in circles
        motion = _motion(level, bounds, start, N, tolerance, rank)
        if motion is None:  # one joint too many
            if vain is None:
                break
            del bounds[vain]
            vain = None
            continue
        rank = motion.rank
        a, b = motion.a, motion.b
        scale, critical = _scale(a, b, box, bounds)
        if scale > best_scale:
            best, best_scale = _inside(b + scale * a, box), scale
        vain = None
        if critical is None:
            done = _inside(a + b, box)
            return _least(level, bounds, done, start, N, box, tolerance, rank) if optimal else done
        if optimal and scale >= 0:
            wrong = _in_vain(-motion.slope[critical] / a[critical], box, bounds)
            vain = max(wrong, key=wrong.__getitem__, default=None)
        if motion.free[critical, critical] <= FREEDOM:
            if vain is None:
                break
            del bounds[vain]
            vain = None
        outwards = a[critical] + b[critical] > box.upper[critical]
        bounds[critical] = float((box.upper if outwards else box.lower)[critical])
    return best


def _least(
    level: LinearizedTask,
    bounds: dict[int, float],
    v: Array,
    start: Array,
    N: Array,
    box: Box,
    tolerance: float,
    rank: int,
) -> Array:
    """From a velocity that does the task, with joints saturated, to the one nearest to `start`.

    Min ||v - start||^2 s.t. the task and the box, by a primal active set.
    """
    for _ in range(4 * len(v)):
        motion = _motion(level, bounds, start, N, tolerance, rank)
        if motion is None:
            break
        way = motion.a + motion.b - v
        room = np.full(len(v), np.inf)
        np.divide(
            np.where(way > 0, box.upper, box.lower) - v, way, out=room, where=abs(way) > NEGLIGIBLE
        )
        room[list(bounds)] = np.inf
        blocked = int(np.argmin(room))
        v = _inside(v + min(1.0, float(room[blocked])) * way, box)
        if room[blocked] < 1:
            bounds[blocked] = float((box.upper if way[blocked] > 0 else box.lower)[blocked])
            continue
        wrong = _in_vain(-motion.slope.T @ (v - start), box, bounds)
        if not wrong:
            break
        del bounds[max(wrong, key=wrong.__getitem__)]
    return v


def _inside(v: Array, box: Box) -> Array:
    """The velocity without what sticks out of the box, which is rounding; faster than `np.clip`."""
    held: Array = np.minimum(np.maximum(v, box.lower), box.upper)
    return held


def _motion(
    level: LinearizedTask,
    bounds: dict[int, float],
    start: Array,
    N: Array,
    tolerance: float,
    rank: int,
) -> _Motion | None:
    """The least motion in the range of N, with joints saturated; None where that costs rank."""
    base, free, effect = start, N, np.empty((len(start), 0))
    if bounds:
        joints = list(bounds)
        rows = N[joints]
        solved = solve_positive_definite(rows[:, joints], rows)
        if solved is None:
            return None
        effect = solved.T
        base = start + effect @ (np.array([*bounds.values()]) - start[joints])
        free = N - effect @ rows
    inverse, row_space = inverse_and_row_space(level.J @ free, tolerance)
    if len(row_space) < rank:
        return None
    b = base - inverse @ (level.J @ base)
    return _Motion(inverse @ level.V, b, free, effect, level.J, inverse, len(row_space))


def _scale(a: Array, b: Array, box: Box, bounds: dict[int, float]) -> tuple[float, int | None]:
    """The largest scale s <= 1 with a s + b in the box, and the joint to saturate next.

    The scale is -1 where there is none that is not negative. The joint is, among those that are
    outside at s = 1, the one that allows the least; None where none is.
    """
    v = a + b
    outside = (v < box.lower) | (v > box.upper)
    saturated = list(bounds)
    outside[saturated] = False
    if not outside.any():
        return 1.0, None
    moves = np.abs(a) > NEGLIGIBLE
    inside = (box.lower <= b) & (b <= box.upper)
    low, high = np.where(inside, -np.inf, np.inf), np.where(inside, np.inf, -np.inf)
    np.divide(np.where(a > 0, box.lower, box.upper) - b, a, out=low, where=moves)
    np.divide(np.where(a > 0, box.upper, box.lower) - b, a, out=high, where=moves)
    low[saturated], high[saturated] = -np.inf, np.inf
    most = min(1.0, float(high.min()))
    scale = most if most >= max(0.0, float(low.max())) else -1.0
    return scale, int(np.argmin(np.where(outside, high, np.inf)))


def _in_vain(gain: Array, box: Box, bounds: dict[int, float]) -> dict[int, float]:
    """The saturated joints that had better come off their bounds, and how much that gains.

    Args:
        gain: what is gained per unit of each bound, (number of saturated joints,).
        box: the velocity box.
        bounds: of the saturated joints.
    """
    return {
        joint: abs(rate)
        for joint, rate in zip(bounds, gain.tolist(), strict=True)
        if (bounds[joint] > box.lower[joint] and rate < -ROUNDING)
        or (bounds[joint] < box.upper[joint] and rate > ROUNDING)
    }
