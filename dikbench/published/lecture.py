"""What lecture notes say of their formulas, on a robot, and their example with a matrix."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Final

import msgspec
import numpy as np

from dikbench.problem.tasks import LinearizedTask, PoseTask, PostureTask
from dikbench.published.measured import Measured, Statistic
from dikbench.published.one_answer import EXACT, answering, random_configurations
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.planar_arm import planar_arm
from dikbench.robots.robot import Robot, model_limits

ROUNDING: Final = 1e-6
"""Tolerance of a solver's answer, per unit of speed."""


class Statements(msgspec.Struct, frozen=True, tag="statements", tag_field="protocol"):
    """Twists or targets at random configurations, and a posture; statements as numbers.

    Attributes:
        robot: see `load_robot`.
        seed: of configurations and twists.
        count: how many.
        size: standard deviation of a twist's rows [m/s; rad/s].
        beside: another formulation whose velocities are said to be the same.
        posture: whether there is a second task, the robot's safe start.
        limited: whether the velocity limits are in force.
        towards: whether targets at other random configurations take the place of twists.
    """

    robot: str = "panda"
    seed: int = 0
    count: int = 200
    size: float = 1.0
    beside: str = ""
    posture: bool = True
    towards: bool = False
    limited: bool = True

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "first_task": Statistic("states in which the first task is not done", 0),
            "first_error": Statistic("largest error of the first task", 2),
            "direction": Statistic("states that leave its direction", 0),
            "limits": Statistic("states outside a velocity limit", 0),
            "beside": Statistic("states in which the two differ", 0),
            "stopped": Statistic("states at rest", 0),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Count the states in which the statements do not hold."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        limit = robot.limits.velocity
        assert limit is not None
        robot = robot.with_limits(position=None)
        if not self.limited:
            robot = robot.with_limits(velocity=None)
        kinematics, answer = Kinematics(robot), answering(formulation)
        other = answering(self.beside) if self.beside else answer
        tasks = (PostureTask(robot.q0),) if self.posture else ()
        failing = {name: 0 for name in self.statistics}
        most = 0.0
        inside = load_robot(self.robot)
        targets = random_configurations(inside, self.count, random)
        for q, other_q in zip(
            random_configurations(inside, self.count, random), targets, strict=True
        ):
            kinematics.update(other_q)
            target = kinematics.placement(robot.frame_id).copy()
            kinematics.update(q)
            J, V = kinematics.task_jacobian(), self.size * random.normal(size=6)
            tracking = LinearizedTask(J, V, np.zeros(6))
            if self.towards:
                tracking = PoseTask(target).linearize(kinematics)
                J, V = tracking.J, tracking.V
            v = answer(kinematics, 0.01, tracking, tasks)
            done = J @ v
            error = float(np.linalg.norm(done - V))
            share = float(done @ V) / float(V @ V)
            scale = max(1.0, float(np.linalg.norm(v)))
            tolerance = ROUNDING * scale
            most = max(most, error)
            failing["first_task"] += error > tolerance
            failing["direction"] += bool(np.linalg.norm(done - share * V) > tolerance)
            failing["limits"] += bool((np.abs(v) > limit.upper + tolerance).any())
            beside = other(kinematics, 0.01, tracking, tasks) if self.beside else v
            failing["beside"] += bool(np.linalg.norm(beside - v) > tolerance)
            failing["stopped"] += bool(np.linalg.norm(v) <= EXACT)
        counts = {name: Measured(n, n, n) for name, n in failing.items()}
        return counts | {"first_error": Measured(most, most, most)}


class Matrix(msgspec.Struct, frozen=True, tag="matrix", tag_field="protocol"):
    """A task J v = V of two rows and two joints, given by its numbers.

    Attributes:
        J: rows of the matrix.
        V: the desired velocity.
        velocity_limit: of both joints; None: none.
    """

    J: tuple[tuple[float, float], tuple[float, float]]
    V: tuple[float, float]
    velocity_limit: float | None = None

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {"first": Statistic("v_1", 6), "second": Statistic("v_2", 6)}
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector for v."""
        kinematics = Kinematics(self._robot())
        tracking = LinearizedTask(np.array(self.J), np.array(self.V), np.zeros(2))
        v = answering(formulation)(kinematics, 0.01, tracking, ())
        return {
            name: Measured(value + 0.0, value, value)
            for name, value in zip(("first", "second"), v.tolist(), strict=True)
        }

    def _robot(self) -> Robot:
        """Return two joints whose own kinematics the task does not use."""
        model = planar_arm((1.0, 1.0), velocity_limits=(1.0, 1.0))
        robot = Robot("two joints", model, "tip", model_limits(model), np.zeros(2), (0, 1))
        return robot.with_limits(position=None, velocity=self.velocity_limit)
