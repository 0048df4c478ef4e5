"""What a solver's tolerance makes of a formulation where one direction is nearly lost."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import msgspec
import numpy as np

from dikbench.problem.tasks import LinearizedTask
from dikbench.published.measured import Measured, Statistic, of_mean
from dikbench.published.one_answer import answering
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot


class StoppingEarly(msgspec.Struct, frozen=True, tag="stopping-early", tag_field="protocol"):
    """Random twists of the task frame at configurations with a nearly singular wrist.

    Attributes:
        robot: see `load_robot`; an arm whose joint number `joint` is singular at 0.
        joint: see there.
        distance: that joint's distance from the singularity [rad].
        speed: norm of the twists [m/s; rad/s].
        seed: of configurations and twists.
        count: how many.
        dt: control period [s].
        solver: of the formulation; default: the default one.
        beside: the same program, solved exactly.
    """

    robot: str = "ur5"
    joint: int = 4
    distance: float = 1e-3
    speed: float = 0.1
    seed: int = 0
    count: int = 200
    dt: float = 0.01
    solver: str = ""
    beside: str = ""

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "fastest": Statistic("mean largest joint speed rad/s", 3),
            "mean": Statistic("mean difference from the optimum rad/s", 3),
            "most": Statistic("largest difference rad/s", 3, extreme=True),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector for all twists."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        answer = answering(formulation, self.solver)
        exact = answering(self.beside or formulation)
        kinematics = Kinematics(robot)
        fastest, differences = np.zeros(self.count), np.zeros(self.count)
        for k in range(self.count):
            q = robot.q0 + random.uniform(-0.3, 0.3, robot.nv)
            q[self.joint] = self.distance
            kinematics.update(q)
            V = random.normal(size=6)
            V *= self.speed / np.linalg.norm(V)
            tracking = LinearizedTask(kinematics.task_jacobian(), V, np.zeros(6))
            v = answer(kinematics, self.dt, tracking, ())
            fastest[k] = np.abs(v).max()
            differences[k] = np.abs(v - exact(kinematics, self.dt, tracking, ())).max()
        return {
            "fastest": of_mean(fastest),
            "mean": of_mean(differences),
            "most": Measured(float(differences.max())),
        }
