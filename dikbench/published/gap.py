"""How near a hand comes to an obstacle with a library's own rows, and with ours."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Final, Literal

import msgspec
import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem.constraints import CollisionConstraint
from dikbench.problem.tasks import PoseTask
from dikbench.published.folder import FOLDER
from dikbench.published.measured import Measured, Statistic
from dikbench.published.one_answer import answering, robot_of
from dikbench.robots.kinematics import Kinematics

URDF: Final = "slider.urdf"
HAND: Final = "tool"
INFLUENCE: Final = 1.0
"""Distance from which on the obstacle is seen [m]."""


class Gap(msgspec.Struct, frozen=True, tag="gap", tag_field="protocol"):
    """A ball on a slide, 5 cm in front of another ball, asked to be where that is at once.

    Attributes:
        rows: whose rows keep it away: mink's `CollisionAvoidanceLimit` in mink's own `solve_ik`, or
            our `CollisionConstraint` with the formulation.
        ahead: distance of the target, which is asked for in one period [m].
        margin: distance to keep [m].
        gain: of mink's limit.
        dt: control period [s].
        steps: how many periods.
        limited: whether the velocity limits, 2 m/s, are in force.
    """

    rows: Literal["mink", "ours"]
    ahead: float = 0.15
    margin: float = 0.005
    gain: float = 0.85
    dt: float = 0.01
    steps: int = 30
    limited: bool = False

    statistics: ClassVar[Mapping[str, Statistic]] = MappingProxyType(
        {
            "first": Statistic("gap after one period m", 4),
            "least": Statistic("smallest gap m", 4),
        }
    )

    def measure(self, formulation: str) -> dict[str, Measured]:
        """Slide with a formulation's selector, or with mink.

        Raises:
            DikbenchError: if mink is not installed.
        """
        gaps = self._minks() if self.rows == "mink" else self._ours(formulation)
        found = {"first": gaps[0], "least": min(gaps)}
        return {name: Measured(gap + 0.0, gap, gap) for name, gap in found.items()}

    def _ours(self, formulation: str) -> list[float]:
        robot = robot_of(URDF, HAND).with_limits(position=None)
        if not self.limited:
            robot = robot.with_limits(velocity=None)
        kinematics, answer = Kinematics(robot), answering(formulation)
        rows = CollisionConstraint(margin=self.margin, influence=INFLUENCE)
        q, gaps = np.zeros(robot.nq), []
        kinematics.update(q)
        target = kinematics.placement(robot.frame_id).copy()
        target.translation = target.translation + np.array([self.ahead, 0.0, 0.0])
        for _ in range(self.steps):
            tracking = PoseTask(target, gain=1 / self.dt).linearize(kinematics)
            q = q + self.dt * answer(kinematics, self.dt, tracking, (), (rows,))
            kinematics.update(q)
            gaps.append(float(rows.pairs(robot).distances(kinematics).min()))
        return gaps

    def _minks(self) -> list[float]:
        try:
            mink, mujoco = (importlib.import_module(name) for name in ("mink", "mujoco"))
        except ImportError:
            raise DikbenchError('mink is not installed: pip install "dikbench[peers]"') from None
        model: Any = mujoco.MjModel.from_xml_path(str(FOLDER / URDF))
        configuration = mink.Configuration(model, q=np.zeros(2))
        hand = mink.FrameTask(HAND, "body", position_cost=1.0, orientation_cost=0.0)
        start = configuration.get_transform_frame_to_world(HAND, "body")
        hand.set_target(
            mink.SE3.from_translation(start.translation() + np.array([self.ahead, 0.0, 0.0]))
        )
        balls = [*range(model.ngeom)]
        limits: list[Any] = [
            mink.CollisionAvoidanceLimit(
                model,
                [([balls[0]], [balls[1]])],
                gain=self.gain,
                minimum_distance_from_collisions=self.margin,
                collision_detection_distance=INFLUENCE,
            )
        ]
        if self.limited:
            limits.append(mink.VelocityLimit(model, {"across": 2.0, "along": 2.0}))
        gaps = []
        for _ in range(self.steps):
            v = mink.solve_ik(configuration, [hand], self.dt, "daqp", limits=limits)
            configuration.integrate_inplace(v, self.dt)
            gaps.append(mujoco.mj_geomDistance(model, configuration.data, *balls, 10.0, None))
        return gaps
