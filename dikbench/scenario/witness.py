"""Joint motions that show that a scenario can be done, and their pace within the limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.problem.constraints import CollisionConstraint, Constraint, TorqueConstraint
from dikbench.problem.embedding import Embedding
from dikbench.robots.robot import Robot
from dikbench.scenario.oracle import OracleMotion
from dikbench.scenario.reference.reference import Reference

Feasible = Literal["time", "path", "no", "unknown"]
"""What a motion is known for that keeps all limits: it follows by the clock; it follows if the path
may wait; there is none, by proof; or nothing is known."""

POSITION_ROUNDING: Final = 1e-9
"""A joint this far outside its position limits [rad or m] is at the limit."""

FARTHER_OUT: Final = 1e-4
"""A joint that starts outside may go farther out by this [rad or m]."""

INSIDE_SHARE: Final = 0.5
"""A joint that starts outside must be inside after this share of the reference's duration."""

ROUNDING_M: Final = 1e-9
"""A distance that falls short of its margin by this keeps it."""

OFF_PATH_M: Final = 1e-6
"""A motion that is off its path by this follows it."""

SLOWEST_PACE: Final = 1e-3
"""Smallest share of the nominal speed at which torques are tried."""


@dataclass(frozen=True, eq=False)
class Witness:
    """A joint motion that does the task and keeps position limits and distances.

    Attributes:
        motion: the motion, on its nominal times.
        paces: the largest share of the nominal speed, at most 1, at which joint speeds and torques
            are within their limits, in each of its intervals, (k,).
    """

    motion: OracleMotion
    paces: Array

    @property
    def by_clock(self) -> bool:
        """Whether the motion keeps all limits at its nominal speed."""
        return bool((self.paces == 1.0).all())

    @property
    def lateness(self) -> float:
        """The time [s] by which the motion is late at its end where it keeps all limits."""
        return float((np.diff(self.motion.instants) * (1 / self.paces - 1)).sum())


def witness_of(
    robot: Robot,
    motion: OracleMotion,
    constraints: Sequence[Constraint],
    v0: Array,
    duration: float,
) -> Witness | None:
    """Return the witness that a joint motion is; None where it is none.

    It keeps the position limits and the distances of the constraints at its samples, and speeds and
    torques are within the limits at its paces. Where torques are limited the pace is constant.
    Acceleration limits must hold at nominal speed, from the velocity at the start on, since a
    slower pace need not be reachable within them.

    Args:
        robot: the robot, with the limits in force.
        motion: the joint motion.
        constraints: conditions in addition to the joint limits.
        v0: joint velocity at the start, (nv,) [rad/s or m/s].
        duration: nominal duration of the reference [s].
    """
    if (beyond(robot, motion, constraints, duration) > 0).any():
        return None
    paces = 1 / np.maximum(1.0, motion.speed_ratio)
    if any(isinstance(constraint, TorqueConstraint) for constraint in constraints):
        pace = _pace_of_torques(robot, motion, float(paces.min(initial=1.0)))
        if pace is None:
            return None
        paces = np.full_like(paces, pace)
    witness = Witness(motion, paces)
    limit = robot.limits.acceleration
    if limit is not None and len(motion.v):
        periods = np.diff(motion.instants)
        between = np.append(periods[0], (periods[1:] + periods[:-1]) / 2)
        changes = np.diff(np.vstack([v0, motion.v]), axis=0)
        changes[0][np.abs(changes[0]) < 1e-6] = 0.0  # rounding of differences of configurations
        if not witness.by_clock or limit.usage(changes / between[:, None]).max() > 1.0:
            return None
    return witness


def does_the_task(
    robot: Robot, motion: OracleMotion, reference: Reference, embedding: Embedding
) -> bool:
    """Say whether the samples of a joint motion are on the path, or its end at a target at rest."""
    last = slice(None) if reference.moving else slice(-1, None)
    times = motion.instants if reference.moving else np.array([reference.duration])
    targets, made = reference.placements(times), motion.placements(robot)[last]
    off = embedding.beside((made[:, :3, :3], made[:, :3, 3]), targets) - embedding.points(*targets)
    return bool(np.linalg.norm(off, axis=1).max() <= OFF_PATH_M)


def beyond(
    robot: Robot, motion: OracleMotion, constraints: Sequence[Constraint], duration: float
) -> Array:
    """Compute how far a motion breaks a position limit or falls short of a distance, (k + 1,).

    The larger of the two [rad or m]; at most 0 where it keeps them. The arguments are those of
    `witness_of`.
    """
    most = outside(robot, motion.q, motion.instants >= INSIDE_SHARE * duration)
    for constraint in constraints:
        if isinstance(constraint, CollisionConstraint):
            distances = constraint.distances(robot, motion.q)
            most = np.maximum(most, constraint.margin - ROUNDING_M - distances)
    return most


def followable(instants: Array, beyond: Array) -> tuple[float | None, bool]:
    """Find until when [s] a motion can be followed, None to its end; and if its end can be reached.

    Args:
        instants: nominal times of its samples, (k + 1,) [s].
        beyond: how far it breaks a limit at them, (k + 1,).
    """
    broken = np.flatnonzero(beyond > 0)
    if not len(broken):
        return None, True
    k, back = int(broken[0]), bool(beyond[-1] <= 0)
    if k == 0 or np.isinf(beyond[k - 1]):
        return float(instants[k]), back
    return float(np.interp(0.0, beyond[k - 1 : k + 1], instants[k - 1 : k + 1])), back


def outside(
    robot: Robot, q: Array, back_inside: Mask, tolerance: float = POSITION_ROUNDING
) -> Array:
    """Compute how far the worst joint is outside of where it may be, (k,); at most 0 inside.

    A joint that starts outside may stay there, but go no farther than `FARTHER_OUT`, until it must
    be back inside.

    Args:
        robot: the robot, with the limits in force.
        q: configurations, the first one at the start, (k, nq).
        back_inside: whether such a joint must be back inside by then, (k,).
        tolerance: distance [rad or m] from its range that counts as inside.
    """
    limits = robot.limits
    if limits.position is None:
        return np.full(len(q), -np.inf)
    values = q[:, limits.q_index]
    excess = np.maximum(values - limits.position.upper, limits.position.lower - values)
    allowed = np.full_like(excess, tolerance)
    started_outside = excess[0] > tolerance
    early = np.flatnonzero(~back_inside)
    allowed[np.ix_(early, started_outside)] = excess[0, started_outside] + FARTHER_OUT
    beyond = np.where(limits.q_index >= 0, excess - allowed, -np.inf)
    worst: Array = beyond.max(axis=1, initial=-np.inf)
    return worst


def _pace_of_torques(robot: Robot, motion: OracleMotion, most: float) -> float | None:
    """Find the largest constant pace at which torques are within their limits, by bisection.

    None where they are not, however slow. The samples of the motion are equally spaced.
    """
    limit, v, period = robot.limits.effort, motion.v, float(np.diff(motion.instants).mean())
    assert limit is not None

    def usage(pace: float) -> float:
        torques = TorqueConstraint().torques(
            robot, motion.q[1:-1], pace * v[1:], pace * v[:-1], period / pace
        )
        return float(limit.usage(torques).max(initial=0.0))

    if usage(most) <= 1.0:
        return most
    low, high = SLOWEST_PACE, most
    if usage(low) > 1.0:
        return None
    while high - low > 1e-3 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if usage(middle) <= 1.0 else (low, middle)
    return low
