"""What a formulation answers where a joint is outside its position limits."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import msgspec
import numpy as np

from dikbench.problem.tasks import PoseTask, PostureTask
from dikbench.published.measured import Measured, Statistic, of_share
from dikbench.published.one_answer import answering, random_configurations
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot


class Outside(msgspec.Struct, frozen=True, tag="outside", tag_field="protocol"):
    """Random configurations with one joint outside a limit, asked to stay where the hand is.

    Attributes:
        robot: see `load_robot`.
        outside: by how much the joint is outside [rad].
        seed: of the configurations.
        count: how many.
        dt: control period [s].
        posture: whether there is a posture task of small weight, as Pink and mink need it.
    """

    robot: str = "panda"
    outside: float = 0.05
    seed: int = 0
    count: int = 200
    dt: float = 0.01
    posture: bool = True

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "unanswered": Statistic("states without an answer %", 1),
            "back": Statistic("states in which the joint goes back %", 1),
            "fastest": Statistic("largest speed over its limit", 2, extreme=True),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector at all configurations."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        position, limit = robot.limits.position, robot.limits.velocity
        assert position is not None
        assert limit is not None
        kinematics, answer = Kinematics(robot), answering(formulation)
        tasks = (PostureTask(robot.q0, gain=0.0, weight=1e-4),) if self.posture else ()
        unanswered, back = np.zeros(self.count, bool), np.zeros(self.count, bool)
        fastest = 0.0
        for k, q in enumerate(random_configurations(robot, self.count, random)):
            joint, side = random.integers(robot.nv), random.choice([-1.0, 1.0])
            bound = position.upper if side > 0 else position.lower
            q[joint] = bound[joint] + side * self.outside
            kinematics.update(q)
            here = kinematics.placement(robot.frame_id).copy()
            tracking = PoseTask(here, gain=1 / self.dt).linearize(kinematics)
            v = answer(kinematics, self.dt, tracking, tasks)
            unanswered[k] = np.isnan(v).any()
            if not unanswered[k]:
                back[k] = side * v[joint] < -1e-6
                fastest = max(fastest, float(limit.usage(v).max()))
        return {
            "unanswered": of_share(unanswered),
            "back": of_share(back),
            "fastest": Measured(fastest),
        }
