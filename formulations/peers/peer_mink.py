"""mink itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar, Final

import numpy as np

from dikbench.errors import SolverFailed
from dikbench.problem import (
    Array,
    DikProblem,
    Interval,
    LimitKind,
    Robot,
    Solve,
)
from formulations.peers.models import TOOL, check_same, coordinates, position_limits, urdf_of
from formulations.peers.peer import (
    IN_DISPLACEMENTS,
    WITH_PEERS,
    PosedPeer,
    Whose,
    is_outside,
    passes_by_tolerance,
    pose_of,
    postures_of,
    six_rows,
)
from formulations.peers.peer_pink import in_velocities
from formulations.peers.same_limits import as_modelled

IDENTITY_BELOW: Final = 1e-5
"""Angle [rad] below which mink takes the derivative of the logarithm for the identity."""


@dataclass(frozen=True)
class PeerMink(PosedPeer):
    """mink itself: `mink.solve_ik` on MuJoCo, a frame task, a posture task for each joint task.

    The model is MuJoCo's, from a URDF of the robot. The frame task is mink's, with its derivative
    of the logarithm (the identity below a rotation of 1e-5 rad), but for its error, which is
    dt Jl V (see `peer-pink`). Costs are roots of our weights; damping 1e-12, mink's.

    Attributes:
        limits: own: the configuration limit of the model (gain 0.95) alone; ours: those of the
            problem; mink has no acceleration limit.
        solver: own: daqp through qpsolvers in displacements, as in mink's examples; ours: the
            trial's solver, in velocities.

    Source: [Mink], solve_ik.
    """

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"mink": WITH_PEERS})
    package: ClassVar[str] = "mink"

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        return "mink-qp"

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The limits of the problem, where it is told of them."""
        kept: frozenset[LimitKind] = frozenset({"position", "velocity"})
        return kept if self.limits == "ours" else frozenset()

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """See `Peer`."""
        if is_outside(problem):
            return "outside position limits mink returns at once"
        if self.limits == "own" and not as_modelled(problem, velocity=False):
            return "mink's own limits are the model's configuration limits, without velocities"
        if problem.v_prev is not None and problem.limits.joint.acceleration is not None:
            return "mink has no acceleration limit"
        if self.solver == "own" and passes_by_tolerance(problem, velocity, 0.95):
            return IN_DISPLACEMENTS
        task, _ = pose_of(problem)
        turned = np.arccos(np.clip((np.trace(task.relative.rotation) - 1) / 2, -1, 1))
        if turned < IDENTITY_BELOW:
            return "mink's derivative of the logarithm is the identity below 1e-5 rad"
        return ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        import mink

        dt, robot = problem.dt, problem.robot
        task, Jl = pose_of(problem)
        peer = _set_up(robot, self.limits)
        configuration, frame = peer.configuration, peer.frame
        q = coordinates(robot, problem.q)
        configuration.update(q)
        relative = mink.SE3.from_matrix(task.relative.homogeneous)
        frame.set_target(configuration.get_transform_frame_to_world(TOOL, "body") @ relative)
        frame.asked = six_rows(problem, dt * (Jl @ task.V))
        cost = six_rows(problem, np.sqrt(task.weight))
        frame.set_position_cost(cost[:3])
        frame.set_orientation_cost(cost[3:])
        tasks = [frame]
        for posture in postures_of(problem):
            tasks.append(mink.PostureTask(peer.model, np.sqrt(posture.weight)))
            tasks[-1].set_target(q + dt * posture.V)
        if self.solver == "ours":
            return solve(
                in_velocities(mink.build_ik(configuration, tasks, dt, limits=peer.limits), dt)
            )
        try:
            v: Array = mink.solve_ik(configuration, tasks, dt, "daqp", limits=peer.limits)
        except mink.NoSolutionFound as error:
            raise SolverFailed(f"mink: {error}") from None
        return v


class _Mink:
    """mink's objects for one robot.

    Attributes:
        model: MuJoCo's model.
        configuration: its configuration.
        frame: its frame task.
        limits: its limits; None: its default one.
    """

    def __init__(self, robot: Robot, whose: Whose) -> None:
        import mink
        import mujoco

        class AskedFrameTask(mink.FrameTask):  # type: ignore[misc]
            """A frame task whose error is given."""

            asked: Array

            def compute_error(self, configuration: Any) -> Array:
                """Return the error that was given, (6,)."""
                return self.asked

            # A frame task computes its error and Jacobian together; this asks for them apart.
            compute_qp_residual = mink.Task.compute_qp_residual

        position: Interval | None = position_limits(robot)
        if whose == "ours":
            position = robot.limits.position
        if position is None:
            position = Interval(np.full(robot.nv, -np.inf), np.full(robot.nv, np.inf))
        self.model = mujoco.MjModel.from_xml_string(urdf_of(robot, position))
        self.limits: list[Any] | None = None
        if whose == "ours":
            self.limits = [mink.ConfigurationLimit(self.model)]
            velocity = robot.limits.velocity
            if velocity is not None:
                pairs = zip(list(robot.model.names)[1:], velocity.upper.tolist(), strict=True)
                fastest = {name: most for name, most in pairs if most < np.inf}
                self.limits.append(mink.VelocityLimit(self.model, fastest))
        self._robot = robot
        self.configuration = mink.Configuration(self.model)
        self.frame = AskedFrameTask(TOOL, "body", 1.0, 1.0)
        check_same(robot, "mink", self._at)

    def _at(self, q: Array) -> tuple[Array, Array]:
        self.configuration.update(coordinates(self._robot, q))
        X = self.configuration.get_transform_frame_to_world(TOOL, "body")
        return X.as_matrix(), self.configuration.get_frame_jacobian(TOOL, "body")


@lru_cache(maxsize=4)
def _set_up(robot: Robot, whose: Whose) -> _Mink:
    return _Mink(robot, whose)
