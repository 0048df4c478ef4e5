"""A frame at a desired placement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
import pinocchio as pin
import scipy.linalg

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, unknown
from dikbench.problem.tasks.rows import in_task_axes, orientation_error
from dikbench.problem.tasks.task import FrameTask, LinearizedTask, check_rotation, check_weight
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import ALL_ROWS, PLANE_ROWS

TILTS: Final = frozenset({3, 4})
"""The rows of turns about axes in the plane."""

ErrorConvention = Literal["log6", "decoupled"]
"""Whether the error of a pose is the logarithm of a placement, or position and rotation apart."""


def goes_along_screw(task: PoseTask, robot: Robot) -> bool:
    """Say whether a pose task brings a frame to its target along a screw (see `PoseTask`)."""
    if task.convention != "log6" or robot.task_axes != "body":
        return False
    rows = robot.task_rows
    return rows == ALL_ROWS or (rows == PLANE_ROWS and not TILTS & {*robot.movable_rows})


@dataclass(frozen=True, eq=False)
class PoseTask(FrameTask):
    """Bring a frame of the robot to a placement in the world.

        e = log6(X^-1 X_d),   V = Ad(X^-1 X_d) V_d + gain e,   J v = V

    with X the placement of the frame, X_d the target, V_d the target's own body twist and J the
    body Jacobian: twists are (linear; angular) [m/s; rad/s] in the axes of the frame. In the plane
    (`Robot.task_rows` of (0, 1, 5) of an arm that cannot tilt) the other rows are left out. Where
    other rows are asked for, or the convention is `decoupled`, position and orientation are brought
    there independently, in the robot's task axes:

        e = (R^T (p_d - p); rotation error),   V = (R^T R_d v_d; R^T R_d w_d) + gain e

    with the rotation error of `dikbench.problem.tasks.rows.orientation_error`: of a whole pose
    log3(R^T R_d), the angle-axis error of most robotics libraries.

    The target is a placement X_d (`pinocchio.SE3`).

    Attributes:
        convention: of the error, `log6` or `decoupled`.
    """

    convention: ErrorConvention = "log6"

    def __post_init__(self) -> None:
        """Check the convention.

        Raises:
            DikbenchError: if there is no such convention.
        """
        if self.convention not in get_args(ErrorConvention):
            raise unknown("pose task: convention", self.convention, get_args(ErrorConvention))

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
        X = kinematics.placement(index)
        if not goes_along_screw(self, robot):
            return self._parts(kinematics, X, X_d, velocity)
        relative = X.actInv(X_d)
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

    def _parts(self, kinematics: Kinematics, X: Any, X_d: Any, velocity: Any) -> LinearizedTask:
        """Linearise position and orientation independently, only the rows that are asked for."""
        robot, R = kinematics.robot, X.rotation
        Q = R.T @ X_d.rotation
        rows = np.array(robot.task_rows)
        error = np.zeros(6)
        error[:3] = in_task_axes(robot, R, R.T @ (X_d.translation - X.translation))
        asked = [row - 3 for row in robot.task_rows if row >= 3]
        if asked:
            error[3:] = orientation_error(robot, Q, R, asked)
        V = self.gain * error
        if velocity is not None:
            V[:3] += in_task_axes(robot, R, Q @ velocity.linear)
            V[3:] += in_task_axes(robot, R, Q @ velocity.angular)
        J = kinematics.jacobian(self.frame_id(robot))
        J = np.vstack([in_task_axes(robot, R, J[:3]), in_task_axes(robot, R, J[3:])])
        J, V, error = J[rows], V[rows], error[rows]
        if is_whole(robot):
            return LinearizedParts(J, V, error, self.weight, self.priority, Q)
        return LinearizedTask(J, V, error, self.weight, self.priority)


def is_whole(robot: Robot) -> bool:
    """Say whether a robot is asked for whole poses in the axes of its frame."""
    return robot.task_rows == ALL_ROWS and robot.task_axes == "body"


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


class LinearizedParts(LinearizedTask, eq=False):
    """A pose task at one configuration, position and orientation apart.

    Attributes:
        relative: R^T R_d, the target's rotation seen from the frame, (3, 3).
    """

    relative: Any = None

    @property
    def log_derivative(self) -> Array | None:
        """The block-diagonal matrix of I and Jlog3(R_d^T R), (6, 6).

        The error changes by -Jl J v as seen from the world: the frame's axes turn on their own.
        """
        Jl: Array = scipy.linalg.block_diag(np.eye(3), pin.Jlog3(self.relative.T))
        return Jl
