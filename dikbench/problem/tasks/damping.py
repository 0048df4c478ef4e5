"""A task that keeps the joints at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dikbench.arrays import Array
from dikbench.linear_algebra import scaled_identity
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask, check_weight
from dikbench.robots.kinematics import Kinematics


@dataclass(frozen=True, eq=False)
class DampingTask:
    """Keep the joints at rest: V = 0 (J = I), with weight lambda^2 Tikhonov's regularisation.

    Attributes:
        weight: see `LinearizedTask`; one number, or one per joint (nv,).
        priority: see `LinearizedTask`; by default below the end-effector task.
    """

    weight: float | Array = 1.0
    priority: int = 2

    def linearize(self, kinematics: Kinematics) -> LinearizedTask:
        """Linearise the task, which is the same at every configuration.

        Raises:
            DikbenchError: if the weights do not fit the robot.
        """
        n = kinematics.robot.nv
        check_weight("damping task", self.weight, n)
        return LinearizedJointTask(
            scaled_identity(n, 1.0), np.zeros(n), np.zeros(n), self.weight, self.priority
        )
