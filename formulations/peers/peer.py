"""What all peers have in common: what they are asked, and what they refuse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Kinematics,
    LinearizedJointTask,
    LinearizedPose,
    Parameters,
    ProblemPart,
    ProgramKind,
)
from formulations.peers.models import has_plain_joints

WITH_PEERS: Final = 'pip install "dikbench[peers]"'
WITH_DRAKE: Final = 'pip install "dikbench[drake]"'

OUTSIDE_RAD: Final = 1e-6
"""A joint that is less outside of a limit [rad or m] counts as inside."""

TOLERANCE_RAD: Final = 1e-6
"""daqp's tolerance of constraints, in displacements [rad or m]: over dt in velocities."""

PASSED_RAD_S: Final = 1e-7
"""A bound that is passed by less [rad/s] is kept."""

IN_DISPLACEMENTS: Final = "its daqp passes bounds by 1e-6 in displacements, 1e-6/dt in velocities"

Whose = Literal["own", "ours"]
"""The peer's own, or those of the problem."""


@dataclass(frozen=True)
class Peer(Parameters):
    """Another library, asked the problem of a control step as its users would.

    Its kinematics are its own, of a model made from the robot's and checked against it; its part of
    the step is timed with its answer. The problem's primary task has to be of the task frame, in
    the frame's axes.
    """

    requires: ClassVar[Mapping[str, str]]
    package: ClassVar[str]
    computes_kinematics: ClassVar[bool] = True
    every_row: ClassVar[bool] = False
    """Whether it has to be asked for all six rows of a twist."""

    @property
    def counterpart(self) -> str:
        """The selector of our formulation that is to answer alike."""
        raise NotImplementedError

    def refuses(self, problem: DikProblem) -> str:
        """Why the peer is not asked such a problem; empty where it is (see `Formulation`)."""
        robot, J = problem.robot, problem.primary.J
        if not has_plain_joints(robot):
            return "asks peers about joints that turn or slide alone: no free base, no followers"
        if robot.task_axes != "body" or (self.every_row and len(robot.task_rows) < 6):
            return "is asked for twists in the task frame's axes" + " of six rows" * self.every_row
        kinematics = Kinematics(robot, robot.scratch)
        kinematics.update(problem.q)
        ours = kinematics.task_jacobian()
        if J.shape != ours.shape or np.abs(J - ours).max() > 1e-9:
            return "is asked for one task of first priority, on the robot's task frame"
        return ""

    def known_difference(self, problem: DikProblem, velocity: Array | None) -> str:
        """Why it may differ from its counterpart here; empty where no reason is known.

        Args:
            problem: the problem.
            velocity: its velocity, (nv,); None where it has none.
        """
        return ""


@dataclass(frozen=True)
class PosedPeer(Peer):
    """A peer that poses a program of a frame task with its placement, and of posture tasks.

    Attributes:
        limits: the peer's own or the problem's.
        solver: the peer's own or the trial's.
    """

    limits: Whose = "own"
    solver: Whose = "own"

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"postures", "weights"})

    @property
    def program(self) -> ProgramKind | None:
        """What it hands to the trial's solver, if it does."""
        return "qp" if self.solver == "ours" else None

    def refuses(self, problem: DikProblem) -> str:
        """See `Peer`."""
        return no_pose(problem) or super().refuses(problem)


def is_outside(problem: DikProblem) -> bool:
    """Say whether a joint is outside its position limits, by more than rounding."""
    to_lower, to_upper = problem.limits.to_lower, problem.limits.to_upper
    if to_lower is None or to_upper is None:
        return False
    return bool(min(to_lower.min(), to_upper.min()) < -OUTSIDE_RAD)


def passes_by_tolerance(problem: DikProblem, velocity: Array | None, gain: float) -> bool:
    """Say whether a velocity passes a bound by no more than a tolerance of displacements allows.

    Args:
        problem: the problem.
        velocity: the velocity, (nv,), or None.
        gain: share of the distance to a position limit per step.
    """
    if velocity is None:
        return False
    box = problem.box("gain", gain)
    most = float(np.maximum(velocity - box.upper, box.lower - velocity).max())
    return PASSED_RAD_S < most <= TOLERANCE_RAD / problem.dt * (1 + 1e-3) + PASSED_RAD_S


def no_pose(problem: DikProblem) -> str:
    """Why a problem's primary task is of no use to a peer that is asked for placements, or ""."""
    task = problem.primary
    if isinstance(task, LinearizedPose) and task.log_derivative is not None:
        return ""
    return "is asked for placements of the task frame: give it a target, no twist"


def pose_of(problem: DikProblem) -> tuple[LinearizedPose, Array]:
    """Return the primary task, a pose, and the derivative of its logarithm, (m, m)."""
    task = problem.primary
    assert isinstance(task, LinearizedPose)
    Jl = task.log_derivative
    assert Jl is not None
    return task, Jl


def postures_of(problem: DikProblem) -> list[LinearizedJointTask]:
    """Return the joint tasks of a problem, of whatever priority."""
    return [task for task in problem.tasks if isinstance(task, LinearizedJointTask)]


def six_rows(problem: DikProblem, values: Array | float) -> Array:
    """Put the values of the rows asked for, (m,) or one for all, in a vector (6,) of zeros."""
    full = np.zeros(6)
    full[list(problem.robot.task_rows)] = values
    return full
