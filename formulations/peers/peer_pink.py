"""Pink itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from dikbench.errors import Infeasible, SolverFailed
from dikbench.problem import (
    Array,
    DikProblem,
    LimitKind,
    QuadraticProgram,
    Robot,
    Solve,
)
from formulations.peers.models import check_same
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
from formulations.peers.same_limits import as_modelled


@dataclass(frozen=True)
class PeerPink(PosedPeer):
    """Pink itself: `pink.solve_ik` with a frame task and a posture task for each joint task.

    The frame task is Pink's, with its derivative of the logarithm, but for its error, which is
    dt Jl V: Pink's own gain dt log6 where the target is at rest, and with the target's twist where
    it moves, for which Pink has no word. Costs are roots of our weights; damping 1e-12, Pink's.

    Attributes:
        limits: own: configuration (gain 0.5) and velocity limits of the model; ours: those of the
            problem, with Pink's acceleration limit where one is in force.
        solver: own: daqp through qpsolvers in displacements, as in Pink's examples; ours: the
            trial's solver, in velocities.

    Source: [Pink] 4.4, solve_ik.
    """

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"pink": WITH_PEERS})
    package: ClassVar[str] = "pin-pink"

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        return "pink-qp"

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The limits of the problem, where it is told of them."""
        kept: frozenset[LimitKind] = frozenset({"position", "velocity", "acceleration"})
        return kept if self.limits == "ours" else frozenset()

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """See `Peer`."""
        if is_outside(problem):
            return "outside position limits Pink refuses to answer"
        if self.limits == "own" and not as_modelled(problem, velocity=True):
            return "Pink's own limits are those of the model"
        if self.solver == "own" and passes_by_tolerance(problem, velocity, 0.5):
            return IN_DISPLACEMENTS
        return "limits that contradict each other have no solution" if problem.relaxed else ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        import pink

        dt = problem.dt
        task, Jl = pose_of(problem)
        peer = _set_up(problem.robot, self.limits)
        configuration, frame = peer.configuration, peer.frame
        configuration.update(problem.q)
        frame.set_target(configuration.get_transform_frame_to_world(frame.frame) * task.relative)
        frame.asked = six_rows(problem, dt * (Jl @ task.V))
        cost = six_rows(problem, np.sqrt(task.weight))
        frame.set_position_cost(cost[:3])
        frame.set_orientation_cost(cost[3:])
        tasks = [frame]
        for posture in postures_of(problem):
            cost = np.sqrt(np.broadcast_to(posture.weight, posture.V.shape))
            tasks.append(pink.tasks.PostureTask(cost))
            tasks[-1].set_target(pin.integrate(configuration.model, problem.q, dt * posture.V))
        limits = peer.limits
        if peer.acceleration is not None and problem.v_prev is not None:
            peer.acceleration.set_last_integration(problem.v_prev, dt)
            limits = [*(limits or ()), peer.acceleration]
        try:
            if self.solver == "own":
                v: Array = pink.solve_ik(configuration, tasks, dt, solver="daqp", limits=limits)
                return v
            configuration.check_limits()
            posed = pink.build_ik(configuration, tasks, dt, limits=limits)
        except pink.exceptions.NotWithinConfigurationLimits as error:
            raise Infeasible(f"Pink: {error}") from None
        except pink.exceptions.NoSolutionFound as error:
            raise SolverFailed(f"Pink: {error}") from None
        return solve(in_velocities(posed, dt))


def in_velocities(posed: Any, dt: float) -> QuadraticProgram:
    """Write a program in displacements (`qpsolvers.Problem`) as one in velocities."""
    h = None if posed.h is None else posed.h / dt
    return QuadraticProgram(posed.P, posed.q / dt, G=posed.G, h=h)


class _Pink:
    """Pink's objects for one robot.

    Attributes:
        configuration: its configuration.
        frame: its frame task.
        limits: its limits but for the next one; None: its default ones.
        acceleration: its acceleration limit, or None.
    """

    def __init__(self, robot: Robot, whose: Whose) -> None:
        import pink

        class AskedFrameTask(pink.tasks.FrameTask):  # type: ignore[misc]
            """A frame task whose error is given."""

            asked: Array

            def compute_error(self, configuration: Any) -> Array:
                """Return the error that was given, (6,)."""
                return self.asked

        # A copy, since Pink keeps attributes of its own on its model.
        model = pin.Model(robot.model)
        self.limits: list[Any] | None = None
        self.acceleration: Any = None
        if whose == "ours":
            joint = robot.limits
            at = joint.q_index
            bounded = at >= 0
            if joint.position is None:
                model.lowerPositionLimit = np.full(model.nq, -np.inf)
                model.upperPositionLimit = np.full(model.nq, np.inf)
            else:
                lower, upper = model.lowerPositionLimit, model.upperPositionLimit
                lower[at[bounded]] = joint.position.lower[bounded]
                upper[at[bounded]] = joint.position.upper[bounded]
                model.lowerPositionLimit, model.upperPositionLimit = lower, upper
            self.limits = [pink.limits.ConfigurationLimit(model)]
            if joint.velocity is not None:
                self.limits.append(pink.limits.VelocityLimit(model, joint.velocity.upper))
            if joint.acceleration is not None:
                a = joint.acceleration.upper
                self.acceleration = pink.limits.AccelerationLimit(model, a)
        self.configuration = pink.Configuration(model, model.createData(), robot.q0)
        self.frame = AskedFrameTask(robot.frame, 1.0, 1.0)
        check_same(robot, "Pink", self._at)

    def _at(self, q: Array) -> tuple[Array, Array]:
        self.configuration.update(q)
        X = self.configuration.get_transform_frame_to_world(self.frame.frame)
        return X.homogeneous, self.configuration.get_frame_jacobian(self.frame.frame)


@lru_cache(maxsize=4)
def _set_up(robot: Robot, whose: Whose) -> _Pink:
    return _Pink(robot, whose)
