"""Inverse kinematics of velocities: twists that some velocity in the box does."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import msgspec
import numpy as np

from dikbench.problem.tasks import LinearizedTask
from dikbench.published.measured import Measured, Statistic, of_share
from dikbench.published.one_answer import answering, random_configurations, robot_of
from dikbench.robots.kinematics import Kinematics


class Twists(msgspec.Struct, frozen=True, tag="twists", tag_field="protocol"):
    """Twists J v of random velocities v inside their limits, at random configurations.

    The formulation sees velocity limits that are smaller by a margin, and no others. It succeeds
    where its answer is inside the limits and does the twist; with scaling, where it does a share of
    it in its direction.

    Attributes:
        robot: see `load_robot`, or the name of a URDF beside the experiments.
        frame: see there.
        seed: of the configurations and velocities.
        count: how many there are.
        published_count: how many the source had, which gives the bands.
        margin: share of the velocity limits that the formulation sees.
        tolerance: of the twist [m/s; rad/s].
        allowance: of the limits [rad/s].
    """

    robot: str
    frame: str
    seed: int = 0
    count: int = 4000
    published_count: int = 1000
    margin: float = 0.98
    tolerance: float = 1e-3
    allowance: float = 1e-6

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {"success": Statistic("success %"), "scaled": Statistic("with scaling %")}
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector for all twists."""
        robot, random = robot_of(self.robot, self.frame), np.random.default_rng(self.seed)
        limit = robot.limits.velocity
        assert limit is not None
        seen = robot.with_limits(position=None, velocity=self.margin * limit.upper)
        configurations = random_configurations(robot, self.count, random)
        velocities = random.uniform(limit.lower, limit.upper, configurations.shape)
        kinematics, answer = Kinematics(seen), answering(formulation)
        whole, scaled = np.zeros(self.count, bool), np.zeros(self.count, bool)
        for k, (q, wanted) in enumerate(zip(configurations, velocities, strict=True)):
            kinematics.update(q)
            J = kinematics.task_jacobian()
            V = J @ wanted
            v = answer(kinematics, 0.01, LinearizedTask(J, V, np.zeros(6)), ())
            inside = bool((np.abs(v) <= limit.upper + self.allowance).all())
            done = J @ v
            share = min(1.0, float(done @ V) / float(V @ V))
            whole[k] = inside and np.linalg.norm(done - V) <= self.tolerance
            scaled[k] = inside and 0 < share and np.linalg.norm(done - share * V) <= self.tolerance
        others = self.published_count
        return {"success": of_share(whole, others), "scaled": of_share(scaled, others)}
