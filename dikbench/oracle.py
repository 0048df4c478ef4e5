"""The joint motion that follows a reference exactly, limits or not: the measure of scenarios."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.errors import DikbenchError
from dikbench.kinematics import Kinematics, smallest_singular_value
from dikbench.references import Reference
from dikbench.robot import Robot
from dikbench.steps import steps_in


def solve_placement(robot: Robot, target: Any, seed: Array, *, iterations: int = 200) -> Array:
    """A configuration whose task frame is at `target`, by damped Gauss-Newton from `seed`.

    Steps are Levenberg-Marquardt with damping by the squared error (Sugihara 2011), at most 0.3 rad
    each; position limits are not looked at.

    Raises:
        DikbenchError: if the residual (m, rad) does not fall below 1e-9.
    """
    kinematics = Kinematics(robot)
    rows = np.array(robot.task_rows)
    q = seed
    error = np.inf
    for _ in range(iterations):
        kinematics.update(q)
        e = pin.log6(kinematics.placement(robot.frame_id).actInv(target)).np[rows]
        before, error = error, float(np.linalg.norm(e))
        if error < 1e-12 or (error < 1e-9 and error >= before):
            return q  # there, or as near as rounding lets it come
        J = kinematics.jacobian(robot.frame_id)[rows]
        H = J.T @ J
        H.flat[:: len(H) + 1] += 0.1 * error**2 + 1e-12
        step = np.linalg.solve(H, J.T @ e)
        largest = float(np.abs(step).max())
        q = pin.integrate(robot.model, q, step * min(1.0, 0.3 / max(largest, 1e-300)))
    raise DikbenchError(
        f"robot {robot.name}: no posture found for the placement, residual {error:.2g}"
    )


@dataclass(frozen=True, eq=False)
class OracleMotion:
    """A joint motion sampled along a reference, and what it asks of the robot.

    Attributes:
        q: configurations, (k + 1, nq).
        v: velocities between them at nominal speed, (k, nv) [rad/s].
        sigma_min: smallest singular value of the task Jacobian (m, rad), (k + 1,).
        speed_ratio: largest |v| over its limit, (k,).
        margin: smallest distance to a position limit [rad], negative outside, (k + 1,).
    """

    q: Array
    v: Array
    sigma_min: Array
    speed_ratio: Array
    margin: Array


def oracle_motion(
    robot: Robot, reference: Reference, q0: Array, dt: float, seeds: Array | None = None
) -> OracleMotion:
    """Follow a reference exactly from q0, sample by sample.

    Args:
        robot: the robot.
        reference: the path.
        q0: configuration at its beginning, (nq,).
        dt: sampling period in nominal time [s].
        seeds: a known joint motion, (k + 1, nq), to be taken as it is; default: each sample is
            solved from the one before.

    Raises:
        DikbenchError: if a sample cannot be reached.
    """
    count = steps_in(reference.duration, dt)
    q = [q0]
    for k in range(1, count + 1):
        if seeds is not None:
            q.append(seeds[k])
        else:
            q.append(solve_placement(robot, reference.placement(k * dt), q[-1]))
    return measure_motion(robot, np.array(q), dt)


def measure_motion(robot: Robot, q: Array, dt: float) -> OracleMotion:
    """Measure a joint motion (k + 1, nq) that is sampled every dt [s]."""
    model, rows = robot.model, np.array(robot.task_rows)
    v = np.array([pin.difference(model, a, b) / dt for a, b in pairwise(q)])
    kinematics = Kinematics(robot)
    sigma, margin = [], []
    for sample in q:
        kinematics.update(sample)
        sigma.append(smallest_singular_value(kinematics.jacobian(robot.frame_id)[rows]))
        margin.append(position_margin(robot, sample))
    limit = robot.limits.velocity
    ratio = np.zeros(len(v)) if limit is None else limit.usage(v).max(axis=1)
    return OracleMotion(q, v, np.array(sigma), ratio, np.array(margin))


def position_margin(robot: Robot, q: Array) -> float:
    """Smallest distance [rad] of a configuration (nq,) to a position limit, negative outside."""
    limits = robot.limits.at(q)
    if limits.to_lower is None or limits.to_upper is None:
        return float("inf")
    return float(min(limits.to_lower.min(), limits.to_upper.min()))
