"""The joint motion that follows a reference exactly, whatever the limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.tasks import PoseTask, TrackingTask
from dikbench.robots.kinematics import along, differences, placements
from dikbench.robots.robot import Robot
from dikbench.scenario.placing import configurations
from dikbench.scenario.reference.reference import Reference

ORACLE = "oracle"
"""The name of the formulation in rows that score this joint motion itself."""

SLOWED_ORACLE = "slowed-oracle"
"""The name in rows that score a joint motion slowed down until it keeps all limits."""

ORACLES = (ORACLE, SLOWED_ORACLE)
"""Formulations of the harness itself, which know the joint motion and do not compete."""

POSE = PoseTask()

SMALL_SQUARE: Final = 1e-4
"""Share of the largest eigenvalue below which rounding is seen in the root of the smallest."""


@dataclass(frozen=True, eq=False)
class OracleMotion:
    """A joint motion sampled along a reference, and its demands on the robot.

    Attributes:
        instants: nominal times of the samples, (k + 1,) [s].
        q: configurations, (k + 1, nq).
        v: velocities between the samples at nominal speed, (k, nv) [rad/s].
        sigma_min: smallest singular value of the task Jacobian (m, rad), (k + 1,).
        speed_ratio: largest |v| over its limit, (k,).
        margin: smallest distance to a position limit [rad], negative outside, (k + 1,).
        reach: distance of the task frame from the first joint [m], (k + 1,).
        exact: the configuration at any nominal time, where it is known in closed form.
    """

    instants: Array
    q: Array
    v: Array
    sigma_min: Array
    speed_ratio: Array
    margin: Array
    reach: Array
    exact: Callable[[float], Array] | None = None
    _placed: tuple[Any, int, Array] | None = field(default=None, init=False, repr=False)

    def placements(self, robot: Robot) -> Array:
        """Return the placements of the robot's task frame at the samples, (k + 1, 4, 4)."""
        known = self._placed
        if known is None or known[0] is not robot.model or known[1] != robot.frame_id:
            known = robot.model, robot.frame_id, placements(robot, robot.frame_id, self.q)
            object.__setattr__(self, "_placed", known)
        return known[2]

    @property
    def peak_speed_ratio(self) -> float:
        """Largest joint speed over its limit."""
        return float(self.speed_ratio.max(initial=0.0))


def solve_placement(
    robot: Robot,
    target: Any,
    seed: Array,
    *,
    tracking: TrackingTask = POSE,
    iterations: int = 200,
) -> Array:
    """Find a configuration that does a tracking task, by damped Gauss-Newton from `seed`.

    Steps are Levenberg-Marquardt with damping by the squared error (Sugihara 2011) of at most
    0.3 rad; position limits are ignored. Joints that slide count by their range
    (`Robot.joint_scale`), so that a short one is not taken far outside where others can move.

    Args:
        robot: the robot.
        target: where the task frame is to be (`pinocchio.SE3`).
        seed: configuration to start from, (nq,).
        tracking: the task; default: the whole pose.
        iterations: largest number of steps.

    Raises:
        DikbenchError: if the residual (m, rad) does not fall below 1e-9.
    """
    q: Array = configurations(robot, [target], seed, tracking, iterations)[0]
    return q


def follow(
    robot: Robot, reference: Reference, q0: Array, instants: Array, tracking: TrackingTask = POSE
) -> Array:
    """Compute configurations (k + 1, nq) that follow a reference exactly from q0 on.

    Each is solved from the previous one, by least-norm steps where the arm has a null space.

    Args:
        robot: the robot.
        reference: the path.
        q0: configuration at the first instant, (nq,).
        instants: nominal times, (k + 1,) [s].
        tracking: the task that follows the reference.

    Raises:
        DikbenchError: if a sample cannot be reached.
    """
    targets = reference.targets(instants[1:])
    return np.vstack([q0, *configurations(robot, targets, q0, tracking)])


def oracle_motion(
    robot: Robot, reference: Reference, q0: Array, instants: Array, tracking: TrackingTask = POSE
) -> OracleMotion:
    """Follow a reference exactly from q0 and measure the motion (see `follow`)."""
    q = follow(robot, reference, q0, instants, tracking)
    return measure_motion(robot, instants, q, tracking)


def joint_oracle(
    robot: Robot,
    configuration: Callable[[float], Array],
    instants: Array,
    tracking: TrackingTask = POSE,
) -> OracleMotion:
    """Measure a joint motion that is known in closed form: tau [s] -> q (nq,)."""
    q = np.array([configuration(tau) for tau in instants])
    return measure_motion(robot, instants, q, tracking, configuration)


def measure_motion(
    robot: Robot,
    instants: Array,
    q: Array,
    tracking: TrackingTask = POSE,
    exact: Callable[[float], Array] | None = None,
) -> OracleMotion:
    """Measure a joint motion (k + 1, nq) at its instants (k + 1,) [s] (see `OracleMotion`)."""
    v = differences(robot, q) / np.diff(instants)[:, None]
    jacobians, placed = along(robot, q, tracking.rows(robot))
    reach = np.linalg.norm(placed[:, :3, 3] - robot.shoulder, axis=1)
    sigma = _smallest_singular_values(jacobians)
    limit = robot.limits.velocity
    ratio = np.zeros(len(v)) if limit is None else limit.usage(v).max(axis=1)
    margins = _position_margins(robot, q)
    motion = OracleMotion(instants, q, v, sigma, ratio, margins, reach, exact)
    object.__setattr__(motion, "_placed", (robot.model, robot.frame_id, placed))
    return motion


def _smallest_singular_values(J: Array) -> Array:
    """Compute the smallest singular value of each of n Jacobians (n, m, nv), (n,).

    Where it is not small, it is as exact, and quicker, from the eigenvalues of J J^T.
    """
    squares = np.linalg.eigvalsh(J @ J.mT if J.shape[1] <= J.shape[2] else J.mT @ J)
    sigma: Array = np.sqrt(np.maximum(squares[:, 0], 0.0))
    small = ~(squares[:, 0] > SMALL_SQUARE * squares[:, -1])
    if small.any():
        sigma[small] = np.linalg.svd(J[small], compute_uv=False)[:, -1]
    return sigma


def position_margin(robot: Robot, q: Array) -> float:
    """Compute the smallest distance [rad] of q (nq,) to a position limit, negative outside.

    A sliding joint counts by its share of its range, 2 pi for all of it (`Robot.joint_scale`); one
    that does not move the task frame counts where it is outside.
    """
    return float(_position_margins(robot, q[None])[0])


def _position_margins(robot: Robot, q: Array) -> Array:
    """Compute `position_margin` of each of several configurations (k, nq), (k,)."""
    position = robot.limits.position
    if position is None:
        return np.full(len(q), np.inf)
    values = q[:, robot.limits.q_index]
    inside = np.minimum(values - position.lower, position.upper - values) / robot.joint_scale
    worst, margins = inside.min(axis=1), inside[:, robot.chain].min(axis=1)
    smallest: Array = np.where(worst < 0, worst, margins)
    return smallest
