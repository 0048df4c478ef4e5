"""The nearness of every joint to what limits it, at every control step."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
import numpy.typing as npt

from dikbench.arrays import Array, Indices, Mask
from dikbench.metrics import VIOLATION_TOLERANCE
from dikbench.metrics.distance_and_torque import RELATIVE_TORQUE_TOLERANCE
from dikbench.problem.constraints import CollisionConstraint, TorqueConstraint
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import JointLimits
from dikbench.robots.robot import Robot
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace

NEAR_SHARE: Final = 0.9
"""Share of a limit from which a joint counts as near it."""


class Nearness(IntEnum):
    """The relation of a joint to its limits."""

    INSIDE = 0
    NEAR = 1
    PAST = 2


Nearnesses = npt.NDArray[np.int_]
"""Values of `Nearness`."""


def joint_nearness(trace: Trace, scenario: Scenario, instants: Indices | None = None) -> Nearnesses:
    """Classify every joint by all that limits it, (k, joints): the worst since the instant before.

    The limits of position and speed, and of torque and distance where the scenario has such
    constraints. A pair of bodies whose distance is below its margin, or near it, counts for both
    joints that carry them; distances are computed at the instants only.

    Args:
        trace: the record of n steps.
        scenario: its case.
        instants: numbers of control steps, ascending, k of 0 to n; default: all.

    Returns:
        A column per joint in Pinocchio's order, without the universe.
    """
    robot, n = scenario.robot, trace.steps
    at = np.arange(n + 1) if instants is None else instants
    of_velocities = nearness(trace, robot.limits)
    if scenario.limits_torques:
        of_velocities[:-1] = np.maximum(of_velocities[:-1], _of_torques(trace, scenario))
    found = np.zeros((n + 1, robot.model.njoints - 1), dtype=np.int_)
    for number, joint in enumerate(robot.model.joints[1:]):
        own = of_velocities[:, joint.idx_v : joint.idx_v + joint.nv]
        found[:, number] = own.max(axis=1, initial=Nearness.INSIDE)
    firsts = np.concatenate([[0], at[:-1] + 1])
    found = np.maximum.reduceat(found[: at[-1] + 1], firsts, axis=0)
    for constraint in scenario.constraints:
        if isinstance(constraint, CollisionConstraint):
            found = np.maximum(found, _of_distances(constraint, robot, trace.q[at]))
    return found


def nearness(trace: Trace, limits: JointLimits) -> Nearnesses:
    """Classify every joint, (n + 1, nv): before each step, with its speed, and at the end.

    A joint is past a limit if it exceeds it by more than `VIOLATION_TOLERANCE`, as in the metrics.
    """
    use, excess = np.zeros((2, trace.steps + 1, limits.nv))
    position, speed = limits.position, limits.velocity
    if position is not None:
        at = trace.q[:, limits.q_index]
        use = _share_of_range(at, position.lower, position.upper)
        excess = np.maximum(at - position.upper, position.lower - at)
    if speed is not None:
        v = trace.applied
        use[:-1] = np.maximum(use[:-1], speed.usage(v))
        too_fast = np.maximum(v - speed.upper, speed.lower - v)
        excess[:-1] = np.maximum(excess[:-1], too_fast)
    return _classified(use >= NEAR_SHARE, excess > VIOLATION_TOLERANCE)


def _of_torques(trace: Trace, scenario: Scenario) -> Nearnesses:
    """Classify every joint by its torque in each step, (n, nv)."""
    robot, v = scenario.robot, np.vstack([scenario.v0, trace.applied])
    limit = robot.limits.effort
    assert limit is not None
    usage = limit.usage(TorqueConstraint().torques(robot, trace.q[:-1], v[1:], v[:-1], trace.dt))
    return _classified(usage >= NEAR_SHARE, usage > 1 + RELATIVE_TORQUE_TOLERANCE)


def _of_distances(constraint: CollisionConstraint, robot: Robot, q: Array) -> Nearnesses:
    """Classify every joint by the distances of what it carries, at configurations, (k, joints).

    Near is a distance that has used `NEAR_SHARE` of the way from the influence to the margin.
    """
    pairs, kinematics = constraint.pairs(robot), Kinematics(robot)
    carried = np.array(pairs.joints)
    near = constraint.margin + (1 - NEAR_SHARE) * (constraint.influence - constraint.margin)
    found = np.zeros((len(q), robot.model.njoints), dtype=np.int_)
    for row, configuration in zip(found, q, strict=True):
        kinematics.update(configuration)
        phi = pairs.distances(kinematics)
        state = _classified(phi <= near, phi < constraint.margin - VIOLATION_TOLERANCE)
        np.maximum.at(row, carried, state[:, None])
    return found[:, 1:]


def _classified(near: Mask, past: Mask) -> Nearnesses:
    return np.where(past, Nearness.PAST, np.where(near, Nearness.NEAR, Nearness.INSIDE))


def _share_of_range(at: Array, lower: Array, upper: Array) -> Array:
    """Compute the distance from mid-range over half the range; 0 where it is unbounded."""
    with np.errstate(invalid="ignore"):  # infinity minus infinity
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        share = np.abs(at - middle) / half
    bounded: Array = np.where(np.isfinite(half), share, 0.0)
    return bounded
