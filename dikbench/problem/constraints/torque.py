"""Torque limits, linear in the velocity of one control step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.constraints.constraint import unit_rows
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import Interval
from dikbench.robots.robot import Robot


@dataclass(frozen=True)
class TorqueConstraint:
    """Keep the joint torques within the effort limits of the robot.

        tau = M(q) (v - v_prev)/dt + b(q, v_prev),   tau_min <= tau <= tau_max

    with M the mass matrix and b the gravity, centrifugal and Coriolis torques at the start of the
    step: the torques that change the velocity from v_prev to v within it. There is a row per finite
    effort limit, the upper ones first, in N m (N) before it is scaled. An unknown v_prev counts as
    rest.

    Source: R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008 (equation of motion).
    """

    def linearize(
        self, kinematics: Kinematics, v_prev: Array | None, dt: float
    ) -> tuple[Array, Array]:
        """See `Constraint`.

        Raises:
            DikbenchError: if the robot has no effort limits in force.
        """
        robot, q = kinematics.robot, kinematics.q
        limit = effort_limits(robot)
        above, below = np.isfinite(limit.upper), np.isfinite(limit.lower)
        rest = np.zeros(robot.nv)
        before = rest if v_prev is None else v_prev
        M = mass_matrix(robot, q)
        # The torque at v = 0, of the step that stops the robot.
        stop = pin.rnea(robot.model, robot.scratch, q, before, -before / dt)
        G = np.vstack([M[above], -M[below]]) / dt
        h = np.concatenate([(limit.upper - stop)[above], (stop - limit.lower)[below]])
        return unit_rows(G, h)

    def torques(self, robot: Robot, q: Array, v: Array, v_prev: Array, dt: float) -> Array:
        """Compute the torques of a motion by the recursive Newton-Euler algorithm.

        Args:
            robot: the robot.
            q: configurations at the start of each step, (n, nq).
            v: velocities applied in each step, (n, nv).
            v_prev: velocities applied before each step, (n, nv).
            dt: control period [s].

        Returns:
            (n, nv) [N m or N].
        """
        model, data = robot.model, robot.scratch
        found = [
            pin.rnea(model, data, *step).copy()
            for step in zip(q, v_prev, (v - v_prev) / dt, strict=True)
        ]
        return np.array(found).reshape(len(found), robot.nv)


def effort_limits(robot: Robot) -> Interval:
    """Return the effort limits in force, at least one of which is finite.

    Raises:
        DikbenchError: if there are none.
    """
    limit = robot.limits.effort
    if limit is not None and np.isfinite([limit.lower, limit.upper]).any():
        return limit
    raise DikbenchError(
        f"robot {robot.name}: a torque constraint needs effort limits; none are in force "
        "(Robot.with_limits(effort=...) sets them)"
    )


def mass_matrix(robot: Robot, q: Array) -> Array:
    """Compute the joint-space mass matrix M(q), (nv, nv), symmetric."""
    upper: Array = np.triu(pin.crba(robot.model, robot.scratch, q))
    return upper + np.triu(upper, 1).T
