"""A frame at a desired orientation, its position free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
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
class OrientationTask(FrameTask):
    """Turn a frame to an orientation in the world, wherever it is.

        e = log3(R^T R_d),   V = R^T R_d w_d + gain e,   J v = V

    with R the frame's rotation, R_d the target's, w_d the angular part of the target's body twist
    and J the angular rows of the body Jacobian, (3, nv) [rad/s] in the axes of the frame. Rows that
    the arm cannot move (`Robot.movable_rows`) are left out. On a robot whose task axes are the
    world's, all are in them.

    The target is a rotation R_d, (3, 3), or a placement (`pinocchio.SE3`).
    """

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """See `FrameTask`."""
        return tuple(row for row in robot.movable_rows if row >= 3)

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """See `FrameTask`."""
        robot = kinematics.robot
        index = self.frame_id(robot)
        rows = np.array(self.rows(robot))
        check_weight("orientation task", self.weight, len(rows))
        goal = self.target if target is None else target
        R_d = part_of_target(
            goal, "rotation", (3, 3), "orientation task: expected a rotation (3, 3)"
        )
        check_rotation("orientation task", R_d)
        R = kinematics.placement(index).rotation
        relative = R.T.dot(R_d)
        error: Array = pin.log3(relative)
        V = self.gain * error
        if velocity is not None:
            V += relative.dot(velocity.angular)
        J = kinematics.jacobian(index)
        kept = rows - 3
        if robot.task_axes == "world":
            J, V, error = J.copy(), R @ V, R @ error
            J[3:] = R @ J[3:]
            relative = R @ relative @ R.T
        return LinearizedOrientation(
            J[rows], V[kept], error[kept], self.weight, self.priority, relative, kept
        )


class LinearizedOrientation(LinearizedTask, eq=False):
    """An orientation task at one configuration.

    Attributes:
        relative: R^T R_d, the target seen from the frame; R_d R^T where the task axes are the
            world's.
        kept: the angular rows that are kept.
    """

    relative: Any = None
    kept: Any = None

    @property
    def log_derivative(self) -> Array | None:
        """Jlog3(R_d^T R), (m, m)."""
        Jl: Array = pin.Jlog3(self.relative.T)
        return Jl[np.ix_(self.kept, self.kept)]
