"""A desired posture of the joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.linear_algebra import scaled_identity
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask, check_weight
from dikbench.robots.kinematics import Kinematics


@dataclass(frozen=True, eq=False)
class PostureTask:
    """Bring the joints to a posture: e = q* (-) q, v = gain e (J = I).

    Attributes:
        target: the posture q*, (nq,).
        gain: 1/s.
        weight: see `LinearizedTask`; one number, or one per joint (nv,).
        priority: see `LinearizedTask`; by default below the end-effector task.
    """

    target: Array
    gain: float = 1.0
    weight: float | Array = 1.0
    priority: int = 2

    def __post_init__(self) -> None:
        """Check the target."""
        if not np.isfinite(self.target).all():
            target = np.asarray(self.target).tolist()
            raise DikbenchError(f"posture task: expected finite numbers, got {target}")

    def linearize(self, kinematics: Kinematics) -> LinearizedTask:
        """Linearise the task at the configuration of `kinematics`.

        Raises:
            DikbenchError: if the target is not an array of the robot's shape (nq,), a norm in it is
                not 1, or the weights do not fit the robot.
        """
        robot = kinematics.robot
        if not isinstance(self.target, np.ndarray) or self.target.shape != robot.q0.shape:
            shape = getattr(self.target, "shape", type(self.target).__name__)
            raise DikbenchError(f"posture task: expected shape ({robot.nq},), got {shape}")
        robot.check_norms(self.target, "posture task: target")
        check_weight("posture task", self.weight, robot.nv)
        error: Array = pin.difference(robot.model, kinematics.q, self.target)
        return LinearizedJointTask(
            scaled_identity(robot.nv, 1.0), self.gain * error, error, self.weight, self.priority
        )
