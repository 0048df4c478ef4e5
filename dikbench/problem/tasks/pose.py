"""A frame at a desired placement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks.task import FrameTask, LinearizedTask, check_rotation, check_weight
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class PoseTask(FrameTask):
    """Bring a frame of the robot to a placement in the world.

        e = log6(X^-1 X_d),   V = Ad(X^-1 X_d) V_d + gain e,   J v = V

    with X the placement of the frame, X_d the target, V_d the target's own body twist and J the
    body Jacobian: twists are (linear; angular) [m/s; rad/s] in the axes of the frame. On an arm
    that cannot move some rows of the twist (`Robot.task_rows`) they are left out.

    The target is a placement X_d (`pinocchio.SE3`).
    """

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """See `FrameTask`."""
        return robot.task_rows

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """See `FrameTask`."""
        robot = kinematics.robot
        index = self.frame_id(robot)
        X_d = self.target if target is None else target
        if not isinstance(X_d, pin.SE3):
            raise DikbenchError(
                f"pose task: expected a pinocchio.SE3 as target, got {type(X_d).__name__}"
            )
        check_rotation("pose task", X_d.rotation)
        check_weight("pose task", self.weight, len(robot.task_rows))
        relative = kinematics.placement(index).actInv(X_d)
        error: Array = pin.log6(relative).np
        V = self.gain * error
        if velocity is not None:
            V += relative.act(velocity).np
        J = kinematics.jacobian(index)
        if len(robot.task_rows) == 6:
            return LinearizedPose(J, V, error, self.weight, self.priority, relative, None)
        rows = np.array(robot.task_rows)
        return LinearizedPose(
            J[rows], V[rows], error[rows], self.weight, self.priority, relative, rows
        )


class LinearizedPose(LinearizedTask, eq=False):
    """A pose task at one configuration.

    Attributes:
        relative: X^-1 X_d, the target seen from the frame.
        rows: the rows of the twist that are kept; None: all six.
    """

    relative: Any = None
    rows: Any = None

    @property
    def log_derivative(self) -> Array | None:
        """Jlog6(X_d^-1 X), (m, m)."""
        Jl: Array = pin.Jlog6(self.relative.inverse())
        return Jl if self.rows is None else Jl[np.ix_(self.rows, self.rows)]
