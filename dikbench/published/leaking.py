"""How much of a task a formulation gives up for the posture below it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Final

import msgspec
import numpy as np

from dikbench.arrays import Array
from dikbench.problem.tasks import LinearizedTask, PostureTask
from dikbench.published.measured import Measured, Statistic, of_share
from dikbench.published.one_answer import answering, random_configurations
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot

NOTICEABLE: Final = 0.01
"""Loss of alpha that is counted."""


class Leak(msgspec.Struct, frozen=True, tag="leak", tag_field="protocol"):
    """Random twists, and a posture that draws the joints to their safe start.

    alpha is the share of the twist that is done in its direction; compared with the largest that
    the limits allow. A state without an answer loses all of it.

    Attributes:
        robot: see `load_robot`; with its limits of position and velocity.
        seed: of configurations and twists.
        count: how many; in every other one a joint is 1 mrad from a limit.
        linear: standard deviation of a linear velocity's rows [m/s].
        angular: of an angular velocity's [rad/s].
        dt: control period [s].
        beside: the formulation with the largest alpha.
        posture: whether there is a posture.
    """

    robot: str = "panda"
    seed: int = 0
    count: int = 400
    linear: float = 0.75
    angular: float = 1.5
    dt: float = 0.01
    beside: str = "lp-alpha"
    posture: bool = True

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "losing": Statistic(f"states that lose more than {NOTICEABLE:g} of alpha %", 1),
            "mean": Statistic("mean loss of alpha", 3),
            "most": Statistic("largest loss", 3, extreme=True),
            "unanswered": Statistic("states without an answer", 0, extreme=True),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Ask a formulation's selector for all twists."""
        robot, random = load_robot(self.robot), np.random.default_rng(self.seed)
        position = robot.limits.position
        assert position is not None
        kinematics = Kinematics(robot)
        answer, largest = answering(formulation), answering(self.beside)
        tasks = (PostureTask(robot.q0),) if self.posture else ()
        sizes = np.repeat([self.linear, self.angular], 3)
        losses, unanswered = np.zeros(self.count), 0
        for k, q in enumerate(random_configurations(robot, self.count, random)):
            if k % 2:
                joint, up = random.integers(robot.nv), bool(random.integers(2))
                q[joint] = position.upper[joint] - 1e-3 if up else position.lower[joint] + 1e-3
            kinematics.update(q)
            J, V = kinematics.task_jacobian(), sizes * random.normal(size=6)
            tracking = LinearizedTask(J, V, np.zeros(6))
            v = answer(kinematics, self.dt, tracking, tasks)
            unanswered += bool(np.isnan(v).any())
            most = _share(J, V, largest(kinematics, self.dt, tracking, ()))
            losses[k] = max(0.0, most - _share(J, V, v))
        return {
            "losing": of_share(losses > NOTICEABLE),
            "mean": Measured(float(losses.mean())),
            "most": Measured(float(losses.max())),
            "unanswered": Measured(unanswered),
        }


def _share(J: Array, V: Array, v: Array) -> float:
    """Compute alpha; 0 where there is no answer."""
    return 0.0 if np.isnan(v).any() else float((J @ v) @ V / (V @ V))
