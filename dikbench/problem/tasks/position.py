"""A frame's origin at a wanted point, its orientation free."""

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
class PositionTask:
    """Bring the origin of a frame to a point in the world, whatever its orientation.

        e = R^T (p_d - p),   V = R^T R_d v_d + gain e,   J v = V

    with R, p the frame's rotation and origin, R_d, p_d the target's, v_d the linear part of the
    target's body twist and J the linear rows of the body Jacobian, (3, nv) [m/s] in the axes of the
    frame. On an arm that cannot move some of these rows at all (`Robot.task_rows`) they are left
    out. For an elbow, name the frame of a joint there.

    Attributes:
        target: point p_d, (3,) [m], or a placement (`pinocchio.SE3`); None: given to `linearize` at
            every step.
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
        return tuple(row for row in robot.task_rows if row < 3)

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
        X = kinematics.placement(index)
        rows = np.array(self.rows(robot))
        check_weight("position task", self.weight, len(rows))
        goal = self.target if target is None else target
        error: Array = X.rotation.T.dot(_point(goal) - X.translation)
        V = self.gain * error
        if velocity is not None:
            if not isinstance(goal, pin.SE3):
                raise DikbenchError("position task: the twist of a target needs its pinocchio.SE3")
            V += X.rotation.T.dot(goal.rotation.dot(velocity.linear))
        J = kinematics.jacobian(index)
        return LinearizedTask(J[rows], V[rows], error[rows], self.weight, self.priority)


def _point(target: Any) -> Array:
    if isinstance(target, pin.SE3):
        point: Array = target.translation
        return point
    if not isinstance(target, np.ndarray) or target.shape != (3,):
        shape = getattr(target, "shape", type(target).__name__)
        raise DikbenchError(f"position task: expected a point (3,) or a pinocchio.SE3, got {shape}")
    return target
