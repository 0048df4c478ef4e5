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
from dikbench.scenario.violation import COLLISION_TOLERANCE_M
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
    """Classify every joint by the worst of all that limits it, (k, joints) (see `limit_states`)."""
    worst: Nearnesses = np.max([*limit_states(trace, scenario, instants).values()], axis=0)
    return worst


def limit_states(
    trace: Trace, scenario: Scenario, instants: Indices | None = None
) -> dict[str, Nearnesses]:
    """Classify every joint by each kind of limit: the worst since the instant before.

    A pair of bodies whose distance is below its margin, or near it, counts for both joints that
    carry them; distances are computed at the instants only.

    Args:
        trace: the record of n steps.
        scenario: its case.
        instants: numbers of control steps, ascending, k of 0 to n; default: all.

    Returns:
        By "position" and "speed", and "torque" and "distance" where the scenario limits them: a
        column per joint in Pinocchio's order, without the universe, (k, joints).
    """
    robot, limits, n = scenario.robot, scenario.robot.limits, trace.steps
    at = np.arange(n + 1) if instants is None else instants
    of_velocities = {"position": _of_positions(trace, limits), "speed": _of_speeds(trace, limits)}
    if scenario.limits_torques:
        of_velocities["torque"] = _of_torques(trace, scenario)
    found = {
        kind: _worst_since(_of_joints(states, robot), at) for kind, states in of_velocities.items()
    }
    distances = [
        _of_distances(constraint, robot, trace.q[at])
        for constraint in scenario.constraints
        if isinstance(constraint, CollisionConstraint)
    ]
    if distances:
        found["distance"] = np.max(distances, axis=0)
    return found


def nearness(trace: Trace, limits: JointLimits) -> Nearnesses:
    """Classify every velocity by position and speed, (n + 1, nv): before each step, and at the end.

    A joint is past a limit if it exceeds it by more than `VIOLATION_TOLERANCE`, as in the metrics.
    """
    return np.maximum(_of_positions(trace, limits), _of_speeds(trace, limits))


def _of_positions(trace: Trace, limits: JointLimits) -> Nearnesses:
    """Classify every velocity by the position of its joint, (n + 1, nv)."""
    position = limits.position
    if position is None:
        return np.zeros((trace.steps + 1, limits.nv), dtype=np.int_)
    at = trace.q[:, limits.q_index]
    excess = np.maximum(at - position.upper, position.lower - at)
    use = _share_of_range(at, position.lower, position.upper)
    return _classified(use >= NEAR_SHARE, excess > VIOLATION_TOLERANCE)


def _of_speeds(trace: Trace, limits: JointLimits) -> Nearnesses:
    """Classify every velocity by its speed in the step that follows, (n + 1, nv)."""
    found, speed, v = (
        np.zeros((trace.steps + 1, limits.nv), np.int_),
        limits.velocity,
        trace.applied,
    )
    if speed is not None:
        excess = np.maximum(v - speed.upper, speed.lower - v)
        found[:-1] = _classified(speed.usage(v) >= NEAR_SHARE, excess > VIOLATION_TOLERANCE)
    return found


def _of_torques(trace: Trace, scenario: Scenario) -> Nearnesses:
    """Classify every velocity by the torque in the step that follows, (n + 1, nv)."""
    robot, v = scenario.robot, np.vstack([scenario.v0, trace.applied])
    limit, found = robot.limits.effort, np.zeros((trace.steps + 1, robot.nv), dtype=np.int_)
    assert limit is not None
    usage = limit.usage(TorqueConstraint().torques(robot, trace.q[:-1], v[1:], v[:-1], trace.dt))
    found[:-1] = _classified(usage >= NEAR_SHARE, usage > 1 + RELATIVE_TORQUE_TOLERANCE)
    return found


def _of_joints(states: Nearnesses, robot: Robot) -> Nearnesses:
    """Take the worst of the velocities of each joint, (n + 1, nv) to (n + 1, joints)."""
    own = [
        states[:, joint.idx_v : joint.idx_v + joint.nv].max(axis=1, initial=Nearness.INSIDE)
        for joint in robot.model.joints[1:]
    ]
    return np.column_stack(own)


def _worst_since(states: Nearnesses, at: Indices) -> Nearnesses:
    """Take the worst of the rows after the instant before, up to each instant."""
    firsts = np.concatenate([[0], at[:-1] + 1])
    worst: Nearnesses = np.maximum.reduceat(states[: at[-1] + 1], firsts, axis=0)
    return worst


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
        state = _classified(phi <= near, phi < constraint.margin - COLLISION_TOLERANCE_M)
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
