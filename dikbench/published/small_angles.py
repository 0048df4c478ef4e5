"""The derivative of the pose error of a formulation where the hand is hardly turned."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import msgspec
import numpy as np
import pinocchio as pin

from dikbench.problem.tasks import PoseTask
from dikbench.published.measured import Measured, Statistic, of_mean
from dikbench.published.one_answer import answering, random_configurations
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot


class SmallAngles(msgspec.Struct, frozen=True, tag="small-angles", tag_field="protocol"):
    """Targets at a distance from the hand and turned by an angle, too far for one control period.

    Attributes:
        robot: see `load_robot`.
        distance: of the target [m].
        angle: by which it is turned [rad].
        gain: of the pose task [1/s].
        seed: of configurations, directions and axes.
        count: how many.
        dt: control period [s].
        beside: the formulation with the derivative of the logarithm.
    """

    robot: str = "panda"
    distance: float = 0.3
    angle: float = 0.0
    gain: float = 20.0
    seed: int = 0
    count: int = 200
    dt: float = 0.01
    beside: str = "mink-qp"

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "mean": Statistic("mean difference of a joint velocity rad/s", significant=2),
            "most": Statistic("largest rad/s", significant=2, extreme=True),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector for all targets."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        kinematics = Kinematics(robot)
        answer, other = answering(formulation), answering(self.beside)
        differences = np.zeros(self.count)
        for k, q in enumerate(random_configurations(robot, self.count, random)):
            kinematics.update(q)
            away, axis = (x / np.linalg.norm(x) for x in random.normal(size=(2, 3)))
            step = pin.SE3(pin.exp3(self.angle * axis), self.distance * away)
            target = kinematics.placement(robot.frame_id) * step
            tracking = PoseTask(target, gain=self.gain).linearize(kinematics)
            differences[k] = np.abs(
                answer(kinematics, self.dt, tracking, ()) - other(kinematics, self.dt, tracking, ())
            ).max()
        return {"mean": of_mean(differences), "most": Measured(float(differences.max()))}
