"""A frame at a wanted orientation, its position free."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks.task import LinearizedTask, check_weight
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot, frame_id


@dataclass(frozen=True, eq=False)
class OrientationTask:
    """Turn a frame to an orientation in the world, wherever it is.

        e = log3(R^T R_d),   V = R^T R_d w_d + gain e,   J v = V

    with R the frame's rotation, R_d the target's, w_d the angular part of the target's body twist
    and J the angular rows of the body Jacobian, (3, nv) [rad/s] in the axes of the frame. On an arm
    that cannot move some of these rows at all (`Robot.task_rows`) they are left out.

    Attributes:
        target: rotation R_d, (3, 3), or a placement (`pinocchio.SE3`); None: given to `linearize`
            at every step.
        gain: 1/s.
        weight: see `LinearizedTask`.
        priority: see `LinearizedTask`.
        frame: name of the frame; None: the robot's task frame.
    """

    target: Any = None
    gain: float = 1.0
    weight: float | Array = 1.0
    priority: int = 1
    frame: str | None = None

    def rows(self, robot: Robot) -> tuple[int, ...]:
        """Return the rows of the twist (linear; angular) that the task is about."""
        return tuple(row for row in robot.task_rows if row >= 3)

    def linearize(
        self, kinematics: Kinematics, target: Any = None, velocity: Any = None
    ) -> LinearizedTask:
        """Linearise the task at the configuration of `kinematics`.

        Args:
            kinematics: the robot at its configuration.
            target: this step's target; default: the task's own.
            velocity: the target's body twist V_d (`pinocchio.Motion`); None: at rest.
        """
        robot = kinematics.robot
        index = robot.frame_id if self.frame is None else frame_id(robot.model, self.frame)
        rows = np.array(self.rows(robot))
        check_weight("orientation task", self.weight, len(rows))
        relative = kinematics.placement(index).rotation.T.dot(
            _rotation(self.target if target is None else target)
        )
        error: Array = pin.log3(relative)
        V = self.gain * error
        if velocity is not None:
            V += relative.dot(velocity.angular)
        J = kinematics.jacobian(index)
        kept = rows - 3
        return LinearizedOrientation(
            J[rows], V[kept], error[kept], self.weight, self.priority, relative, kept
        )


class LinearizedOrientation(LinearizedTask, eq=False):
    """An orientation task at one configuration.

    Attributes:
        relative: R^T R_d, the target seen from the frame.
        kept: the angular rows that are kept.
    """

    relative: Any = None
    kept: Any = None

    @property
    def log_derivative(self) -> Array | None:
        """Jlog3(R_d^T R), (m, m)."""
        Jl: Array = pin.Jlog3(self.relative.T)
        return Jl[np.ix_(self.kept, self.kept)]


def _rotation(target: Any) -> Array:
    if isinstance(target, pin.SE3):
        rotation: Array = target.rotation
        return rotation
    if not isinstance(target, np.ndarray) or target.shape != (3, 3):
        shape = getattr(target, "shape", type(target).__name__)
        raise DikbenchError(
            f"orientation task: expected a rotation (3, 3) or a pinocchio.SE3, got {shape}"
        )
    return target
