"""A scenario: a robot, a start, a reference motion, limits in force, and a certificate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.constraints import CollisionConstraint, Constraint, TorqueConstraint
from dikbench.problem.embedding import Embedding, Placements, embedding_of
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.problem.tasks import Task, TrackingTask, TrackingTogether
from dikbench.problem.tasks.task import check_rotation
from dikbench.robots.collision.obstacles import Obstacle
from dikbench.robots.robot import Robot
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.held_frame import HeldFrame, held_frames
from dikbench.scenario.oracle import OracleMotion, follow, solve_placement
from dikbench.scenario.reference.embedded_path import EmbeddedPath, embedded_path
from dikbench.scenario.reference.path import ReferencePath, reference_path
from dikbench.scenario.reference.reference import Reference
from dikbench.scenario.situation import Situation
from dikbench.scenario.steps import steps_in
from dikbench.scenario.variation import NO_VARIATION, Variation
from dikbench.scenario.witness import Feasible, Witness

REST_ROUNDING_S: Final = 1e-9
"""A reference that moves is at its end when this nominal time remains."""

Judged = Literal["path", "end"]
"""What of a motion is judged: its whole way, or where it ends."""


def first_level(tracking: TrackingTask, tasks: tuple[Task, ...]) -> TrackingTask:
    """Stack the tracking task with the other tasks of its priority."""
    equal = tuple(task for task in tasks if task.priority == tracking.priority)
    return TrackingTogether(tracking, equal) if equal else tracking


@dataclass(frozen=True, eq=False)
class Scenario:
    """A closed-loop case, made once from parameters and a seed.

    Attributes:
        robot: the robot, with the limits that are in force.
        q0: start configuration, (nq,).
        v0: joint velocity at the start, (nv,) [rad/s]: the reference's own, so that a run does not
            begin with a jump from rest.
        reference: the desired motion of the task frame.
        tracking: the task that follows it: pose, position or orientation.
        dt: control period [s].
        duration: length of a time-indexed run [s]; a reference that moves rests at its end until
            then.
        certificate: the claims about its difficulty.
        tasks: other tasks, of lower or the same priority.
        motion: the joint motion from which the path was built, on which the certificate was
            measured, from q0 on; None where no joint motion follows the reference.
        variation: the ranges of what a seed perturbs.
        constraints: conditions in addition to the joint limits.
        tolerance_m: distance from the path, and from the target at the end, up to which the task
            counts as done [m] (see `Embedding`).
        judged: whether the whole path is judged, or the end alone.
        longest_path_run: nominal durations after which a path-indexed run ends, if not with its
            path before.
        feasible: what a motion is known for that keeps all limits.
        witness: that motion; None where none is known.
        infeasible_because: the proof that there is none, in words, where it is `no`; else empty.
        followable_until: nominal time [s] at which the exact motion first breaks a position limit
            or a distance, or where the reference leaves the reach; None where the reference can be
            followed to its end.
        comes_back: whether the end of the reference can be reached.
        situation: what is difficult about it.
        characteristic_length: L [m]; a turn by a small angle counts as L times as much of a way.
    """

    robot: Robot
    q0: Array
    v0: Array
    reference: Reference
    tracking: TrackingTask
    dt: float
    duration: float
    certificate: Certificate
    tasks: tuple[Task, ...] = ()
    motion: OracleMotion | None = None
    variation: Variation = NO_VARIATION
    constraints: tuple[Constraint, ...] = ()
    tolerance_m: float = 0.005
    judged: Judged = "path"
    longest_path_run: float = 5.0
    feasible: Feasible = "unknown"
    witness: Witness | None = None
    infeasible_because: str = ""
    followable_until: float | None = None
    comes_back: bool = True
    situation: Situation = "free space"
    characteristic_length: float = CHARACTERISTIC_LENGTH_M

    def __post_init__(self) -> None:
        """Check the number of control steps (see `steps_in`), the start and the reference.

        Raises:
            DikbenchError: if the start is no configuration, or the reference no placement at its
                start, middle or end.
        """
        steps_in(self.duration, self.dt)
        self.robot.check_norms(self.q0, "scenario: start")
        for share in (0.0, 0.5, 1.0):
            placement = self.reference.placement(share * self.reference.duration)
            check_rotation("scenario", placement.rotation)

    @cached_property
    def steps(self) -> int:
        """Number of control steps of a time-indexed run."""
        return steps_in(self.duration, self.dt)

    @property
    def need(self) -> float:
        """The largest joint speed of the exact motion over its limit; NaN where there is none."""
        return float("nan") if self.motion is None else self.motion.peak_speed_ratio

    @cached_property
    def rows(self) -> tuple[int, ...]:
        """The rows of the twist (linear; angular) of the task frame that are tracked."""
        return self.tracking.rows(self.robot)

    @cached_property
    def first(self) -> TrackingTask:
        """The tracking task stacked with the tasks of its priority."""
        return first_level(self.tracking, self.tasks)

    @cached_property
    def targets(self) -> list[tuple[Any, Any]]:
        """Placement and body twist of the reference before each step and after the last.

        They are those of a time-indexed run: `pinocchio.SE3` and `pinocchio.Motion`.
        """
        return [self.target(k * self.dt) for k in range(self.steps + 1)]

    def target(self, tau: float) -> tuple[Any, Any]:
        """Compute placement and body twist of the reference at a nominal time [s].

        At its end, and after it, a reference that moves is at rest. The last twist before leads to
        the end in one control period, and not past it.
        """
        reference = self.reference
        if not reference.moving:
            return reference.placement(tau), pin.Motion(reference.velocity(tau))
        left = reference.duration - tau
        if left < REST_ROUNDING_S:
            return reference.placement(reference.duration), pin.Motion.Zero()
        share = min(1.0, left / self.dt)
        return reference.placement(tau), pin.Motion(share * reference.velocity(tau))

    @cached_property
    def target_arrays(self) -> tuple[Array, Array]:
        """Rotations (n + 1, 3, 3) and translations (n + 1, 3) of `targets`."""
        return self.reference.placements(self._target_times)

    @cached_property
    def _target_times(self) -> Array:
        """Nominal times of `targets`, (n + 1,) [s]: a reference that moves rests at its end."""
        times = self.dt * np.arange(self.steps + 1, dtype=float)
        end = self.reference.duration
        return (
            np.where(end - times < REST_ROUNDING_S, end, times) if self.reference.moving else times
        )

    @cached_property
    def target_twists(self) -> Array:
        """Body twists (n + 1, 6) of `targets`."""
        reference, times = self.reference, self._target_times
        twists = np.array([reference.velocity(tau) for tau in times.tolist()])
        if not reference.moving:
            return twists
        left = reference.duration - times
        shares = np.where(left < REST_ROUNDING_S, 0.0, np.minimum(1.0, left / self.dt))
        shared: Array = shares[:, None] * twists
        return shared

    @cached_property
    def path(self) -> ReferencePath | None:
        """The path of the reference; None for a target at rest."""
        reference = self.reference
        return reference_path(reference, self.dt) if reference.moving else None

    @cached_property
    def embedding(self) -> Embedding:
        """Maps placements of the task frame to points, by what is tracked of them."""
        start = self.reference.placement(0.0).rotation
        return embedding_of(self.tracking, self.robot, start, self.characteristic_length)

    @cached_property
    def embedded_path(self) -> EmbeddedPath | None:
        """The path of the reference in position and orientation; None for a target at rest."""
        if not self.reference.moving:
            return None
        return embedded_path(self.reference, self.embedding, self.dt)

    def points_at(
        self, times: Array, placements: Placements, targets: Placements
    ) -> tuple[Array, Array]:
        """Map placements of the task frame, and of its targets, to points, (n, d) [m] each.

        Where points are by the task's error, those of the targets are on the pieces of the path.

        Args:
            times: nominal times of the targets, (n,) [s].
            placements: rotations (n, 3, 3) and translations (n, 3) [m] of the task frame.
            targets: the same of the targets.
        """
        embedding, path = self.embedding, self.embedded_path
        if path is not None and embedding.by_error:
            at = path.at(times)
        else:
            at = embedding.points(*targets)
        return embedding.beside(placements, targets, at), at

    @property
    def limits_torques(self) -> bool:
        """Whether torque limits are a condition."""
        return any(isinstance(each, TorqueConstraint) for each in self.constraints)

    @property
    def obstacles(self) -> list[Obstacle]:
        """The obstacles of all constraints."""
        return [
            obstacle
            for constraint in self.constraints
            if isinstance(constraint, CollisionConstraint)
            for obstacle in constraint.obstacles
        ]

    @cached_property
    def held_frames(self) -> tuple[HeldFrame, ...]:
        """The other frames whose tasks are of the priority of the tracking."""
        return held_frames(self.robot, self.tracking, self.tasks, self.characteristic_length)

    def along(self, motion: OracleMotion, tau: float) -> Array:
        """Compute the configuration of a joint motion at a nominal time [s], (nq,).

        Between two samples it is the posture next to their mean that does the task.
        """
        if motion.exact is not None:
            return motion.exact(tau)
        k = min(int(np.searchsorted(motion.instants, tau, side="right")) - 1, len(motion.q) - 2)
        begin, end = motion.instants[k : k + 2]
        share = (tau - begin) / (end - begin)
        between: Array = pin.interpolate(self.robot.model, motion.q[k], motion.q[k + 1], share)
        if not self.reference.moving:
            return between
        target = self.reference.placement(tau)
        return solve_placement(self.robot, target, between, tracking=self.first)

    @cached_property
    def oracle(self) -> Array | None:
        """The exact joint motion at every control step, (n + 1, nq); None where there is none.

        Where it is not one that keeps position limits and distances, but another is known, it is
        the other one.

        Raises:
            DikbenchError: if it cannot be followed at this control period.
        """
        if self.motion is None:
            return None
        instants = self.dt * np.arange(self.steps + 1, dtype=float)
        if self.reference.moving:
            instants = np.minimum(instants, self.reference.duration)
        motion = self.motion if self.witness is None else self.witness.motion
        if motion.exact is not None or motion is not self.motion:
            return np.array([self.along(motion, tau) for tau in instants])
        return follow(self.robot, self.reference, self.q0, instants, self.first)
