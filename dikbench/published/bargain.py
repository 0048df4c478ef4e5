"""What a damped inverse loses of a motion, and what it saves in joint speed."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import msgspec
import numpy as np

from dikbench.problem.tasks import LinearizedTask
from dikbench.published.measured import Measured, Statistic, of_mean
from dikbench.published.one_answer import answering, random_configurations
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot


class Bargain(msgspec.Struct, frozen=True, tag="bargain", tag_field="protocol"):
    """Unit twists at random configurations, of a formulation that is linear in the twist.

    Attributes:
        robot: see `load_robot`.
        seed: of configurations and twists.
        count: how many.
        near: the smallest singular value below which a configuration counts as nearly singular.
    """

    robot: str
    seed: int = 0
    count: int = 400
    near: float = 0.05

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "speed": Statistic("largest joint speed per unit of twist", 1, extreme=True),
            "near": Statistic("share lost near singularities", 4),
            "away": Statistic("share lost away from them", 5),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Measure the inverse of a formulation's selector."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        kinematics, answer = Kinematics(robot), answering(formulation)
        configurations = random_configurations(robot, self.count, random)
        twists = random.normal(size=(self.count, 6))
        speed, lost, near = np.zeros(self.count), np.zeros(self.count), np.zeros(self.count, bool)
        for k, (q, twist) in enumerate(zip(configurations, twists, strict=True)):
            kinematics.update(q)
            J, V = kinematics.task_jacobian(), twist / np.linalg.norm(twist)
            columns = [
                answer(kinematics, 0.01, LinearizedTask(J, unit, np.zeros(6)), ())
                for unit in np.eye(6)
            ]
            inverse = np.array(columns).T
            speed[k] = np.linalg.norm(inverse, 2)
            lost[k] = np.linalg.norm(J @ inverse @ V - V)
            near[k] = smallest_singular_value(J) < self.near
        return {
            "speed": Measured(float(speed.max())),
            "near": of_mean(lost[near]),
            "away": of_mean(lost[~near]),
        }
