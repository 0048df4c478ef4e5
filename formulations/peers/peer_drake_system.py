"""Drake's system itself."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Final

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    ProblemPart,
    Range,
    Robot,
    Solve,
)
from formulations.drake_system import DrakeSystem
from formulations.peers.early_stop import STOPS_EARLY, may_stop_at, posed
from formulations.peers.models import TOOL, coordinates, position_limits, urdf_of, velocity_limits
from formulations.peers.peer import WITH_DRAKE, Peer, Whose, postures_of
from formulations.peers.peer_drake import PlantOfRobot
from formulations.peers.quiet import without_stdout
from formulations.peers.same_limits import as_modelled

FAST: Final = 1e6
"""A speed [m/s and rad/s] that no goal of the system exceeds: its clamp is not in our problems."""


@dataclass(frozen=True)
class PeerDrakeSystem(Peer):
    """Drake itself: `DifferentialInverseKinematicsSystem` of a twist in the world's axes.

    Its recipe is that of `drake-system`: least squares, joint centring, joint velocity limits, the
    system's own constants of the last. The plant is Drake's, from a URDF of the robot; the solver
    OSQP, Drake's own, which stops early, near singularities far from the optimum, and passes bounds
    by up to 1e-4 rad/s: nothing is promised. Where it fails the system answers 0.

    Attributes:
        limits: own: velocity and position limits of the model; ours: those of the problem.
        tracking_weight: the weight of least squares; Drake's default is 1, its manual advises 100.
        centering: the gain [1/s] towards the problem's posture.

    Source: [Drake], DifferentialInverseKinematicsSystem.
    """

    limits: Whose = "own"
    tracking_weight: Annotated[float, Range(above=0.0), Drawn(1.0, 1e4, log=True)] = 100.0
    centering: Annotated[float, Range(0.0, unit="1/s"), Drawn(0.0, 10.0)] = 1.0

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"pydrake": WITH_DRAKE})
    package: ClassVar[str] = "drake"
    every_row: ClassVar[bool] = True

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        given = f"tracking_weight={self.tracking_weight},centering={self.centering}"
        return f"drake-system[{given}]"

    @property
    def sees(self) -> frozenset[ProblemPart]:
        """The posture, where joints are drawn to one."""
        return frozenset({"postures"}) if self.centering else frozenset()

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """See `Peer`."""
        if self.limits == "own" and not as_modelled(problem, velocity=True):
            return "Drake's own limits are those of the model"
        if velocity is None:
            return ""
        ours = DrakeSystem(tracking_weight=self.tracking_weight, centering=self.centering)
        return STOPS_EARLY if may_stop_at(posed(ours, problem), velocity) else ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        from pydrake.common.value import Value
        from pydrake.multibody.math import SpatialVelocity
        from pydrake.systems.framework import BusValue

        robot, V = problem.robot, problem.primary.V
        peer = _set_up(robot, self, problem.dt)
        q = coordinates(robot, problem.q)
        peer.at.move(problem.q)
        R = peer.at.tool.CalcPoseInWorld(peer.at.context).rotation().matrix()
        wanted = BusValue()
        wanted.Set(peer.tool, Value(SpatialVelocity(R @ V[3:], R @ V[:3])))
        nominal = next((p.error for p in postures_of(problem) if p.error.any()), 0 * q)
        for port, value in (
            ("position", q),
            ("nominal_posture", q + nominal),
            ("desired_cartesian_velocities", wanted),
        ):
            peer.system.GetInputPort(port).FixValue(peer.context, value)
        with without_stdout():  # OSQP says "Polishing not needed"
            v: Array = np.array(peer.system.GetOutputPort("commanded_velocity").Eval(peer.context))
        return v


class _System:
    """Drake's system for one robot.

    Attributes:
        system: the system.
        context: its context.
        at: the plant that it was made of.
        tool: the name of the task frame in it.
    """

    def __init__(self, robot: Robot, asked: PeerDrakeSystem, dt: float) -> None:
        from pydrake.common import Parallelism
        from pydrake.multibody.inverse_kinematics import (
            DifferentialInverseKinematicsSystem as System,
        )
        from pydrake.multibody.math import SpatialVelocity
        from pydrake.planning import DofMask, RobotDiagramBuilder, SceneGraphCollisionChecker

        logging.getLogger("drake").setLevel(logging.WARNING)  # of contexts that it allocates
        builder = RobotDiagramBuilder()
        position = position_limits(robot)
        (instance,) = builder.parser().AddModelsFromString(urdf_of(robot, position), "urdf")
        checker = SceneGraphCollisionChecker(
            model=builder.Build(),
            robot_model_instances=[instance],
            edge_step_size=0.1,
            implicit_context_parallelism=Parallelism(False),
        )
        plant = checker.plant()
        self.at = PlantOfRobot(robot, plant, plant.CreateDefaultContext())
        least_squares, centring = (
            System.LeastSquaresCost.Config(),
            System.JointCenteringCost.Config(),
        )
        least_squares.cartesian_qp_weight = asked.tracking_weight
        centring.posture_gain = asked.centering
        recipe = System.Recipe()
        recipe.AddIngredient(System.LeastSquaresCost(least_squares))
        recipe.AddIngredient(System.JointCenteringCost(centring))
        recipe.AddIngredient(
            System.JointVelocityLimitConstraint(
                System.JointVelocityLimitConstraint.Config(), _limits(robot, asked.limits)
            )
        )
        self.tool = f"{plant.GetModelInstanceName(instance)}::{TOOL}"
        fast = SpatialVelocity(np.full(3, FAST), np.full(3, FAST))
        every = DofMask(robot.nv, True)
        self.system = System(recipe, "world", checker, every, dt, 1.0, fast)
        self.context = self.system.CreateDefaultContext()


def _limits(robot: Robot, whose: Whose) -> Any:
    """Make Drake's `JointLimits`."""
    from pydrake.planning import JointLimits

    position, fastest = position_limits(robot), velocity_limits(robot)
    none = np.full(robot.nv, np.inf)
    lower, upper, slow, fast = position.lower, position.upper, -fastest, fastest
    if whose == "ours":
        joint = robot.limits
        lower, upper = (
            (joint.position.lower, joint.position.upper) if joint.position else (-none, none)
        )
        slow, fast = (
            (joint.velocity.lower, joint.velocity.upper) if joint.velocity else (-none, none)
        )
    return JointLimits(
        position_lower=lower,
        position_upper=upper,
        velocity_lower=slow,
        velocity_upper=fast,
        acceleration_lower=-none,
        acceleration_upper=none,
    )


@lru_cache(maxsize=4)
def _set_up(robot: Robot, asked: PeerDrakeSystem, dt: float) -> _System:
    return _System(robot, asked, dt)
