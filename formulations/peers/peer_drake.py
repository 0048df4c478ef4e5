"""Drake's function itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np

from dikbench.errors import SolverFailed
from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Interval,
    LimitKind,
    ProblemPart,
    Range,
    Robot,
    Solve,
)
from formulations.drake import Drake
from formulations.peers.early_stop import STOPS_EARLY, may_stop_at, posed
from formulations.peers.models import (
    TOOL,
    check_same,
    coordinates,
    in_body_axes,
    position_limits,
    urdf_of,
)
from formulations.peers.peer import WITH_DRAKE, Peer, Whose, is_outside, postures_of, six_rows


@dataclass(frozen=True)
class PeerDrake(Peer):
    """Drake itself: `DoDifferentialInverseKinematics` of its plant and the frame's twist.

    The plant is Drake's, from a URDF of the robot. Rows that the robot is not asked for are left
    out by Drake's flags. Its solver is Drake's own: OSQP where there is a null space, else CLP.
    Where it is stuck (alpha below 0.01) its velocity is taken; where it finds none it has none.

    Attributes:
        limits: own: none, Drake's default; ours: those of the problem.
        centering: the gain K [1/s] towards the problem's posture.

    Source: [Drake], DoDifferentialInverseKinematics.
    """

    limits: Whose = "own"
    centering: Annotated[float, Range(0.0, unit="1/s"), Drawn(0.0, 10.0)] = 0.0

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"pydrake": WITH_DRAKE})
    package: ClassVar[str] = "drake"

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        return f"drake[centering={self.centering}]"

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The limits of the problem, where it is told of them."""
        kept: frozenset[LimitKind] = frozenset({"position", "velocity", "acceleration"})
        return kept if self.limits == "ours" else frozenset()

    @property
    def sees(self) -> frozenset[ProblemPart]:
        """The posture, where joints are drawn to one."""
        return frozenset({"postures"}) if self.centering else frozenset()

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """See `Peer`."""
        if self.limits == "own":
            return "Drake has no limits of its own"
        if is_outside(problem):
            return "outside position limits Drake returns within one step, or finds nothing"
        J, V = problem.primary.J, problem.primary.V
        if velocity is None:
            box = problem.box("one-step")
            rests = bool((box.lower <= 0.0).all() and (box.upper >= 0.0).all())
            return "Drake finds nothing, although rest is inside every limit" if rests else ""
        if J.shape[1] <= len(J):  # CLP's answer, exact
            return ""
        progress = float((J @ velocity) @ V / (V @ V)) if V.any() else 0.0
        program = posed(Drake(centering=self.centering), problem)
        return STOPS_EARLY if may_stop_at(program, np.append(velocity, progress)) else ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        from pydrake.multibody.inverse_kinematics import (
            DifferentialInverseKinematicsStatus,
            DoDifferentialInverseKinematics,
        )

        robot, primary = problem.robot, problem.primary
        peer = _set_up(robot, self.limits, self.centering)
        peer.move(problem.q)
        before = np.zeros(robot.nv) if problem.v_prev is None else problem.v_prev
        peer.plant.SetVelocities(peer.context, before)
        parameters = peer.parameters
        parameters.set_time_step(problem.dt)
        if self.limits == "ours":
            bound = robot.limits.acceleration
            if bound is not None and problem.v_prev is None:
                bound = Interval(np.full(robot.nv, -np.inf), np.full(robot.nv, np.inf))
            if bound is not None:
                parameters.set_joint_acceleration_limits((bound.lower, bound.upper))
        if self.centering:
            q = coordinates(robot, problem.q)
            wanted = next((p.error for p in postures_of(problem) if p.error.any()), 0 * q)
            parameters.set_nominal_joint_position(q + wanted)
        R = peer.tool.CalcPoseInWorld(peer.context).rotation().matrix()
        V = six_rows(problem, primary.V)
        twist = np.concatenate([R @ V[3:], R @ V[:3]])
        found = DoDifferentialInverseKinematics(
            peer.plant, peer.context, twist, peer.tool, parameters
        )
        if found.status == DifferentialInverseKinematicsStatus.kNoSolutionFound:
            raise SolverFailed("Drake: kNoSolutionFound")
        v: Array = np.array(found.joint_velocities)
        return v


class PlantOfRobot:
    """Drake's plant of a robot.

    Attributes:
        plant: the `MultibodyPlant`.
        context: its context.
        tool: its task frame.
    """

    def __init__(self, robot: Robot, plant: Any, context: Any) -> None:
        self._robot = robot
        self.plant = plant
        self.context = context
        self.tool = plant.GetFrameByName(TOOL)
        check_same(robot, "Drake", self._at)

    def move(self, q: Array) -> None:
        """Put the plant at a configuration (nq,) of the robot."""
        self.plant.SetPositions(self.context, coordinates(self._robot, q))

    def _at(self, q: Array) -> tuple[Array, Array]:
        from pydrake.multibody.tree import JacobianWrtVariable

        self.move(q)
        X, world = self.tool.CalcPoseInWorld(self.context), self.plant.world_frame()
        J = self.plant.CalcJacobianSpatialVelocity(
            self.context, JacobianWrtVariable.kV, self.tool, np.zeros(3), world, world
        )
        return X.GetAsMatrix4(), in_body_axes(X.rotation().matrix(), np.vstack([J[3:], J[:3]]))


class _Drake(PlantOfRobot):
    """A plant with the parameters of the function.

    Attributes:
        parameters: its limits and gains; the step sets what changes.
    """

    def __init__(self, robot: Robot, whose: Whose, centering: float) -> None:
        from pydrake.multibody.inverse_kinematics import DifferentialInverseKinematicsParameters
        from pydrake.multibody.parsing import Parser
        from pydrake.multibody.plant import MultibodyPlant

        plant = MultibodyPlant(0.0)
        Parser(plant).AddModelsFromString(urdf_of(robot, position_limits(robot)), "urdf")
        plant.Finalize()
        super().__init__(robot, plant, plant.CreateDefaultContext())
        n, joint = robot.nv, robot.limits
        self.parameters: Any = DifferentialInverseKinematicsParameters(n, n)
        flags = six_rows_asked(robot)
        self.parameters.set_end_effector_velocity_flag(np.roll(flags, 3))
        if centering:
            self.parameters.set_joint_centering_gain(centering * np.eye(n))
        if whose == "ours" and joint.position is not None:
            pair = joint.position.lower, joint.position.upper
            self.parameters.set_joint_position_limits(pair)
        if whose == "ours" and joint.velocity is not None:
            pair = joint.velocity.lower, joint.velocity.upper
            self.parameters.set_joint_velocity_limits(pair)


def six_rows_asked(robot: Robot) -> Array:
    """Say which of the six rows (linear; angular) the robot is asked for, (6,) of 0 and 1."""
    asked = np.zeros(6)
    asked[list(robot.task_rows)] = 1.0
    return asked


@lru_cache(maxsize=4)
def _set_up(robot: Robot, whose: Whose, centering: float) -> _Drake:
    return _Drake(robot, whose, centering)
