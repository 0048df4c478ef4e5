"""The centre of mass at a desired point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks.task import LinearizedTask, check_weight
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import checked_vector


@dataclass(frozen=True, eq=False)
class CentreOfMassTask:
    """Bring the centre of mass of the robot to a point: e = c* - c, V = gain e, J v = V.

    c (3,) [m] and its Jacobian J (3, nv) are in the axes of the world.

    Attributes:
        target: the point c*, (3,) [m].
        gain: 1/s.
        weight: see `LinearizedTask`.
        priority: see `LinearizedTask`; by default below the end-effector task.
    """

    target: Array
    gain: float = 1.0
    weight: float | Array = 1.0
    priority: int = 2

    def __post_init__(self) -> None:
        """Check the target and keep a read-only copy of it."""
        target = checked_vector(self.target, 3, "centre-of-mass task")
        target.flags.writeable = False
        object.__setattr__(self, "target", target)

    def linearize(self, kinematics: Kinematics) -> LinearizedTask:
        """Linearise the task at the configuration of `kinematics`.

        Raises:
            DikbenchError: if the robot has no mass, or the weights are not one or three.
        """
        check_weight("centre-of-mass task", self.weight, 3)
        centre, J = kinematics.centre_of_mass()
        if not np.isfinite(centre).all():
            raise DikbenchError(
                f"centre-of-mass task: robot {kinematics.robot.name} has no mass in its model"
            )
        error: Array = self.target - centre
        return LinearizedTask(J, self.gain * error, error, self.weight, self.priority)
