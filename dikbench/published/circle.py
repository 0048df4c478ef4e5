"""A circle that a hand follows, a step of a formulation per control period."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import ClassVar, Final

import msgspec
import numpy as np
import pinocchio as pin

from dikbench.problem.tasks import PoseTask, PostureTask
from dikbench.published.measured import Measured, Statistic
from dikbench.published.one_answer import answering
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

POINT: Final = "tracked point"


class Circle(msgspec.Struct, frozen=True, tag="circle", tag_field="protocol"):
    """A circle in the world's x-z plane about the hand's pose at the start, without feed-forward.

    Each period the target moves on, the formulation is asked for a step that reaches it (gain
    1/dt), the step is made and the distance of the hand from that target measured. The first
    target is a radius away from the hand, which the first periods, not counted, are for.

    Attributes:
        robot: see `load_robot`.
        frame: see there.
        point: distance of the tracked point from the origin of the frame along its z axis [m].
        start: configuration at the start, and the target of the posture task.
        dt: control period [s].
        radius: [m].
        frequency: [Hz].
        warm_up: periods that are not counted.
        steps: those that are.
        posture_weight: weight of the posture task.
        band: share of a number by which it may differ; nothing is random here.
    """

    robot: str
    frame: str
    start: tuple[float, ...]
    point: float = 0.0
    dt: float = 0.01
    radius: float = 0.08
    frequency: float = 0.5
    warm_up: int = 30
    steps: int = 150
    posture_weight: float = 1e-4
    band: float = 0.005

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "mean": Statistic("mean position error m", significant=3),
            "most": Statistic("largest m", significant=3),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Follow the circle with a formulation's selector."""
        robot = self._robot().with_limits(position=None, velocity=None)
        kinematics, answer = Kinematics(robot), answering(formulation)
        q = np.array(self.start)
        kinematics.update(q)
        target = kinematics.placement(robot.frame_id).copy()
        centre = target.translation.copy()
        pose = PoseTask(gain=1 / self.dt)
        posture = PostureTask(q.copy(), gain=1 / self.dt, weight=self.posture_weight)
        errors = []
        for k in range(self.warm_up + self.steps):
            angle = 2 * np.pi * self.frequency * k * self.dt
            away = np.array([np.cos(angle), 0.0, np.sin(angle)])
            target.translation = centre + self.radius * away
            q = q + self.dt * answer(
                kinematics, self.dt, pose.linearize(kinematics, target), (posture,)
            )
            kinematics.update(q)
            here = kinematics.placement(robot.frame_id).translation
            errors.append(float(np.linalg.norm(here - target.translation)))
        counted = errors[self.warm_up :]
        found = {"mean": float(np.mean(counted)), "most": max(counted)}
        return {
            name: Measured(value, (1 - self.band) * value, (1 + self.band) * value)
            for name, value in found.items()
        }

    def _robot(self) -> Robot:
        """Load the robot, with the tracked point as its task frame."""
        robot = load_robot(self.robot, self.frame)
        model, frame = robot.model.copy(), robot.model.frames[robot.frame_id]
        away = pin.SE3(np.eye(3), np.array([0.0, 0.0, self.point]))
        placed = frame.placement * away
        model.addFrame(pin.Frame(POINT, frame.parentJoint, placed, pin.FrameType.OP_FRAME))
        return replace(robot, model=model, frame=POINT)
