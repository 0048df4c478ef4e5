"""EmbodiK itself."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Final

import msgspec
import numpy as np

from dikbench.errors import CannotAnswer, SolverFailed
from dikbench.problem import (
    Array,
    DikProblem,
    LimitKind,
    LinearizedJointTask,
    Robot,
    Solve,
)
from formulations.peers.models import (
    TOOL,
    UNLIMITED,
    check_same,
    position_limits,
    urdf_of,
)
from formulations.peers.peer import WITH_PEERS, Peer, Whose
from formulations.peers.same_limits import as_modelled
from formulations.sns import SaturationInNullSpace

SAME_RAD_S: Final = 1e-6
"""Velocities that differ by less are the same."""

NEARLY_NONE: Final = 1e-3
"""A smaller share of a task is almost none of it."""

NO_SOLVER: Final[Any] = None
"""In place of the solver of formulations that have no program."""

UNDAMPED: Final = 1e-9
"""Singular values below this are damped where damping is to be none."""


@dataclass(frozen=True)
class PeerEmbodik(Peer):
    """EmbodiK itself: `KinematicsSolver.solve_velocity` of one frame task that is scaled.

    Its saturation in the null space, in C++ on its own Pinocchio, from a URDF of the robot; the
    frame task has the problem's twist, in the world's axes; other tasks are left out.

    Attributes:
        limits: own: position and velocity limits of the model; ours: those of the problem.
        damping: own: EmbodiK's of singular values near 0.1, which most postures of an arm have;
            ours: none, as `sns` has none.

    Source: EmbodiK 0.23, after [Flacco2015].
    """

    limits: Whose = "own"
    damping: Whose = "own"

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"embodik": WITH_PEERS})
    package: ClassVar[str] = "embodik"
    every_row: ClassVar[bool] = True

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        return "sns"

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The limits of the problem, where it is told of them."""
        kept: frozenset[LimitKind] = frozenset({"position", "velocity"})
        return kept if self.limits == "ours" else frozenset()

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """See `Peer`."""
        if self.limits == "own" and not as_modelled(problem, velocity=True):
            return "EmbodiK's own limits are those of the model"
        try:
            return "" if velocity is None else self._causes(problem, velocity)
        except CannotAnswer:
            return ""

    def _causes(self, problem: DikProblem, velocity: Array) -> str:
        """Say what its velocity owes to damping, to being asked for one task, and to its scale.

        Raises:
            CannotAnswer: if it has no velocity without damping, or ours has none.
        """
        causes, undamped = [], velocity
        if self.damping == "own":
            undamped = replace(self, damping="ours").velocity(problem, NO_SOLVER)
            if _apart(undamped, velocity):
                causes.append("damps singular values near 0.1")
        ours = SaturationInNullSpace()
        both = ours.velocity(problem, NO_SOLVER)
        if _apart(undamped, both):
            alone = [task for task in problem.tasks if not isinstance(task, LinearizedJointTask)]
            first = ours.velocity(msgspec.structs.replace(problem, tasks=alone), NO_SOLVER)
            if _apart(first, both):
                causes.append("is asked for the first task alone")
            if _apart(undamped, first):
                scaled = _how_scaled(problem, undamped, first)
                if not scaled:
                    return ""
                causes.append(scaled)
        return f"EmbodiK {' and '.join(causes)}" if causes else ""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        V = problem.primary.V
        peer = _set_up(problem.robot, self, problem.dt)
        peer.model.update_configuration(problem.q)
        R = peer.placement()[:3, :3]
        peer.task.set_target_velocity(np.concatenate([R @ V[:3], R @ V[3:]]))
        found = peer.solver.solve_velocity(problem.q)
        if found.status.name != "SUCCESS":
            raise SolverFailed(f"EmbodiK: {found.status.name}")
        v: Array = np.array(found.joint_velocities)
        return v


def _apart(one: Array, other: Array) -> bool:
    """Say whether two velocities (nv,) are different ones."""
    return bool(np.abs(one - other).max() > SAME_RAD_S)


def _how_scaled(problem: DikProblem, velocity: Array, first: Array) -> str:
    """Say how a velocity makes less of the first task than ours, (nv,), or leaves it; or "".

    Both go along V, theirs less far; or no scale fits, so that ours rests: then theirs leaves V,
    or turns joints for less than `NEARLY_NONE` of it.
    """
    J, V = problem.primary.J, problem.primary.V
    theirs, ours = J @ velocity, J @ first
    square = float(V @ V)
    scale, most = (float(made @ V) / square if square else 0.0 for made in (theirs, ours))
    along, rests = not _apart(theirs, scale * V), not _apart(ours, np.zeros_like(ours))
    if along and scale < most:
        return "scales it before it has used all joints"
    if rests and not along:
        return "leaves it where no scale fits"
    if rests and scale < NEARLY_NONE:
        return "turns joints for almost none of it where ours rests"
    return ""


class _Embodik:
    """EmbodiK's objects for one robot.

    Attributes:
        model: its model.
        solver: its solver.
        task: its frame task.
    """

    def __init__(self, robot: Robot, asked: PeerEmbodik, dt: float) -> None:
        import embodik

        position, joint, ours = position_limits(robot), robot.limits, asked.limits == "ours"
        if ours and joint.position is not None:
            position = joint.position
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(urdf_of(robot, position), encoding="utf-8")
            self.model: Any = embodik.RobotModel(str(file))
        self._axes = embodik.ReferenceFrame.LOCAL
        self.solver: Any = embodik.KinematicsSolver(self.model)
        self.solver.dt = dt
        self.task: Any = self.solver.add_frame_task("task", TOOL, embodik.TaskType.FRAME_POSE)
        if asked.damping == "ours":
            self.solver.set_tolerance(UNDAMPED)
            self.solver.set_damping(0.0)
        if ours:
            self.solver.enable_position_limits(joint.position is not None)
            self.solver.enable_velocity_limits(joint.velocity is not None)
            if joint.velocity is not None:
                for number, most in enumerate(joint.velocity.upper.tolist()):
                    self.solver.set_joint_velocity_limit(number, min(most, UNLIMITED))
        check_same(robot, "EmbodiK", self._at)

    def placement(self) -> Array:
        """Return the placement of the task frame, (4, 4)."""
        found: Array = self.model.get_frame_pose(TOOL).homogeneous()
        return found

    def _at(self, q: Array) -> tuple[Array, Array]:
        self.model.update_configuration(q)
        return self.placement(), self.model.get_frame_jacobian(TOOL, self._axes)


@lru_cache(maxsize=4)
def _set_up(robot: Robot, asked: PeerEmbodik, dt: float) -> _Embodik:
    return _Embodik(robot, asked, dt)
