"""A frame's origin at a desired point, its orientation free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem.tasks.rows import in_task_axes
from dikbench.problem.tasks.task import (
    FrameTask,
    LinearizedTask,
    check_rotation,
    check_weight,
    part_of_target,
)
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class PositionTask(FrameTask):
    """Bring the origin of a frame to a point in the world, whatever its orientation.

        e = R^T (p_d - p),   V = R^T R_d v_d + gain e,   J v = V

    with R, p the frame's rotation and origin, R_d, p_d the target's, v_d the linear part of the
    target's body twist and J the linear rows of the body Jacobian, (3, nv) [m/s] in the axes of the
    frame. Rows that the arm cannot move (`Robot.movable_rows`) are left out. On a robot whose task
    axes are the world's, all are in them.

    The target is a point p_d, (3,) [m], or a placement (`pinocchio.SE3`).
    """

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """See `FrameTask`."""
        return tuple(row for row in robot.movable_rows if row < 3)

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """See `FrameTask`."""
        robot = kinematics.robot
        index = self.frame_id(robot)
        X = kinematics.placement(index)
        rows = np.array(self.rows(robot))
        check_weight("position task", self.weight, len(rows))
        goal = self.target if target is None else target
        point = part_of_target(goal, "translation", (3,), "position task: expected a point (3,)")
        error = in_task_axes(robot, X.rotation, X.rotation.T.dot(point - X.translation))
        V = self.gain * error
        if velocity is not None:
            if not isinstance(goal, pin.SE3):
                raise DikbenchError("position task: the twist of a target needs its pinocchio.SE3")
            check_rotation("position task", goal.rotation)
            asked = X.rotation.T.dot(goal.rotation.dot(velocity.linear))
            V += in_task_axes(robot, X.rotation, asked)
        J = in_task_axes(robot, X.rotation, kinematics.jacobian(index)[:3])
        return LinearizedTask(J[rows], V[rows], error[rows], self.weight, self.priority)
