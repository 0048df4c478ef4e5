"""A motion: a trace, and what follows from it for the task frame, its limits and its distances."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.metrics.along_path import AlongPath
from dikbench.problem.constraints import CollisionConstraint, TorqueConstraint
from dikbench.problem.progress import progress, row_weights
from dikbench.problem.tasks import PostureTask
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.robots.limits import Interval
from dikbench.scenario.reference.path import NEGLIGIBLE_LENGTH_M
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace

SINGULAR_VALUE_STRIDE: Final = 16
"""The singular values of one matrix in so many are computed in any case."""

BLUR: Final = 1e-6
"""How much rounding may change a small singular value (m, rad) when its matrix is squared."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A trace of n control steps and quantities derived from it, computed on first use.

    Attributes:
        trace: the trace.
        scenario: the case that it is a trace of.
        translations: origin of the task frame in the world, (n + 1, 3) [m].
        position_error: distance of the task frame from its target, (n + 1,) [m]; NaN where the
            task is about the orientation only.
        orientation_error: angle between them, (n + 1,) [rad]; NaN where the task is about the
            position only.
        jacobians: task Jacobians (m, rad), (n + 1, m, nv).
        points: placements of the task frame as points, (n + 1, d) [m] (see `Embedding`).
        target_points: those of its target, (n + 1, d) [m].
    """

    trace: Trace
    scenario: Scenario
    translations: Array
    position_error: Array
    orientation_error: Array
    jacobians: Array
    points: Array
    target_points: Array

    @cached_property
    def achieved(self) -> Array:
        """Twist of the task frame under the applied velocity, (n, m) [m/s; rad/s]."""
        twists: Array = np.einsum("kij,kj->ki", self.jacobians[:-1], self.trace.applied)
        return twists

    @cached_property
    def progress(self) -> Array:
        """Share of the desired motion that each step but dwells made, (k,) (see `progress`)."""
        weights = row_weights(self.scenario.rows)
        alpha = progress(self.trace.wanted, self.achieved, weights)
        return alpha[~np.isnan(alpha)]

    @cached_property
    def velocities(self) -> Array:
        """Joint velocity at the start and in each step, (n + 1, nv) [rad/s]."""
        return np.vstack([self.scenario.v0, self.trace.applied])

    @cached_property
    def accelerations(self) -> Array:
        """Joint acceleration into each step, (n, nv) [rad/s^2]."""
        a: Array = np.diff(self.velocities, axis=0) / self.trace.dt
        return a

    @cached_property
    def position_excess(self) -> Array:
        """Largest distance of a joint outside its position limits, (n + 1,) [rad or m].

        At the start and after each step; 0 inside, and where no limits are in force.
        """
        limits = self.scenario.robot.limits
        return _worst_excess(self.trace.q[:, limits.q_index], limits.position)

    @cached_property
    def velocity_excess(self) -> Array:
        """The same for the velocity limits, in each step, (n,) [rad/s or m/s]."""
        return _worst_excess(self.trace.applied, self.scenario.robot.limits.velocity)

    @cached_property
    def acceleration_excess(self) -> Array:
        """The same for the acceleration limits, into each step, (n,) [rad/s^2 or m/s^2]."""
        return _worst_excess(self.accelerations, self.scenario.robot.limits.acceleration)

    @cached_property
    def contour_error(self) -> Array:
        """Distance of the task frame from the path of the reference, (n + 1,) [m].

        The nearest point of the whole path counts, whatever its nominal time, in the rows that are
        asked for. Without a path it is the distance from the target. NaN where the task is about
        the orientation only.
        """
        scenario = self.scenario
        path, embedded = scenario.path, scenario.embedded_path
        if path is None or embedded is None or np.isnan(self.position_error[0]):
            return self.position_error
        if 2 in scenario.robot.movable_rows and not {0, 1, 2} <= {*scenario.rows}:
            k = len(scenario.embedding.linear)
            return replace(embedded, points=embedded.points[:, :k]).nearest(self.points[:, :k])[0]
        return path.distances(self.translations)

    @cached_property
    def tracking_error(self) -> Array:
        """Distance from the target in position and orientation, (n + 1,) [m] (see `Embedding`).

        Of several frames of the first priority the one that is farthest from its target counts.
        """
        away = np.linalg.norm(self.points - self.target_points, axis=1)
        farthest: Array = np.maximum(away, self._held_apart[0])
        return farthest

    @cached_property
    def contour_error_6d(self) -> Array:
        """Distance from the path in position and orientation, (n + 1,) [m] (see `Embedding`).

        The nearest point of the whole path counts, whenever the reference is there. Of a target
        without a path it is the distance from the target.
        """
        path = self.scenario.embedded_path
        if path is None:
            return self.tracking_error
        away: Array = np.maximum(self.nearest_on_path[0], self._held_apart[0])
        return away

    @cached_property
    def nearest_on_path(self) -> tuple[Array, Indices, Array]:
        """See `EmbeddedPath.nearest`: of the task frame, at every instant."""
        path = self.scenario.embedded_path
        assert path is not None
        return path.nearest(self.points)

    @cached_property
    def along_path(self) -> AlongPath | None:
        """How it follows the path; None of a target without a path, or whose path is a point."""
        path, scenario = self.scenario.embedded_path, self.scenario
        if path is None or path.arcs[-1] <= NEGLIGIBLE_LENGTH_M:
            return None
        return AlongPath(path, self.trace, scenario, self.points, self._held_apart[1])

    @cached_property
    def _held_apart(self) -> tuple[Array, Array]:
        """How far held frames are from their targets, (n + 1,) [m] each.

        At the instants, and in the segments that lead to them.
        """
        apart = np.zeros((2, self.trace.steps + 1))
        for held in self.scenario.held_frames:
            X = placements(self.scenario.robot, held.frame, self.trace.q)
            away = held.away(X[:, :3, :3], X[:, :3, 3])
            ways = np.diff(away, axis=0)
            squares = np.einsum("ij,ij->i", ways, ways)
            along = np.einsum("ij,ij->i", -away[:-1], ways)
            share = np.clip(along / np.where(squares > 0, squares, 1.0), 0.0, 1.0)
            between = away.copy()
            between[1:] = away[:-1] + share[:, None] * ways
            apart = np.maximum(apart, np.linalg.norm([away, between], axis=2))
        return apart[0], apart[1]

    @cached_property
    def second_task_error(self) -> Array:
        """Norm of the errors of the second tasks, (n + 1,) [their units]; empty without any.

        Posture tasks do not count, since they only use the redundancy of the arm.
        """
        second = [task for task in self.scenario.tasks if not isinstance(task, PostureTask)]
        if not second:
            return np.empty(0)
        kinematics, norms = Kinematics(self.scenario.robot), []
        for q in self.trace.q:
            kinematics.update(q)
            errors = [task.linearize(kinematics).error for task in second]
            norms.append(float(np.linalg.norm(np.concatenate(errors))))
        return np.array(norms)

    @cached_property
    def distances(self) -> Array:
        """Smallest distance under a collision constraint, (n + 1,) [m]; empty without one."""
        return _smallest(self._distances)

    @cached_property
    def clearance(self) -> Array:
        """Smallest distance less the margin of its constraint, (n + 1,) [m]; empty without one."""
        pairs = zip(self._distances, self._collisions, strict=True)
        return _smallest([distances - constraint.margin for distances, constraint in pairs])

    @cached_property
    def distance_remainders(self) -> Array:
        """Fall of distances below what the rows of each step predict, (n,) [m].

        The largest over the pairs that had rows (see `CollisionConstraint.remainders`); empty
        without a collision constraint.
        """
        robot, q = self.scenario.robot, self.trace.q
        parts = [constraint.remainders(robot, q) for constraint in self._collisions]
        return 0.0 - _smallest([part.min(axis=1, initial=0.0) for part in parts])

    @cached_property
    def torque_usage(self) -> Array:
        """Largest joint torque over its limit, in each step, (n,); empty where none is limited."""
        robot, trace = self.scenario.robot, self.trace
        limit = robot.limits.effort
        for constraint in self.scenario.constraints:
            if isinstance(constraint, TorqueConstraint) and limit is not None:
                v = self.velocities
                torques = constraint.torques(robot, trace.q[:-1], v[1:], v[:-1], trace.dt)
                usage: Array = limit.usage(torques).max(axis=1, initial=0.0)
                return usage
        return np.empty(0)

    @cached_property
    def sigma_min(self) -> float:
        """Smallest singular value of the task Jacobian (m, rad) during the motion."""
        return _smallest_singular_value(self.jacobians)

    @cached_property
    def _distances(self) -> list[Array]:
        """Smallest distance of each collision constraint, (n + 1,) [m] each."""
        robot, q = self.scenario.robot, self.trace.q
        return [constraint.distances(robot, q) for constraint in self._collisions]

    @property
    def _collisions(self) -> list[CollisionConstraint]:
        constraints = self.scenario.constraints
        return [each for each in constraints if isinstance(each, CollisionConstraint)]


def _smallest(parts: list[Array]) -> Array:
    """Return the smallest of arrays of one shape, element by element; empty without any."""
    smallest: Array = np.min(parts, axis=0) if parts else np.empty(0)
    return smallest


def _worst_excess(values: Array, interval: Interval | None) -> Array:
    """Compute how far the worst joint is outside its interval, of values (k, nv), (k,)."""
    if interval is None:
        return np.zeros(len(values))
    outside: Array = np.maximum(values - interval.upper, interval.lower - values)
    worst: Array = outside.max(axis=1, initial=0.0)
    return worst


def _smallest_singular_value(J: Array) -> float:
    """Compute the smallest singular value that a sequence of matrices (k, m, n) comes to.

    It changes by at most the norm of the change of its matrix (Weyl): the values of a few matrices
    exclude most others, and a lower bound that takes a quarter of the time excludes most of these.
    """
    steps = np.arange(len(J))
    group = steps // SINGULAR_VALUE_STRIDE
    middle = np.minimum(group * SINGULAR_VALUE_STRIDE + SINGULAR_VALUE_STRIDE // 2, len(J) - 1)
    values = np.linalg.svd(J[np.unique(middle)], compute_uv=False)[:, -1]
    changes = np.diff(J, axis=0).reshape(len(J) - 1, J[0].size)
    way = np.append(0.0, np.cumsum(np.sqrt(np.einsum("ki,ki->k", changes, changes))))
    open_ = J[values[group] - np.abs(way - way[middle]) < values.min()]
    open_ = open_[_singular_value_floor(open_) < values.min() + BLUR]
    return float(np.linalg.svd(open_, compute_uv=False)[:, -1].min(initial=values.min()))


def _singular_value_floor(J: Array) -> Array:
    """Compute what the smallest singular value of each J (k, m, n) is not below, but for `BLUR`.

    1/sigma_min^2 is the largest eigenvalue of (J J^T)^-1 and thus at most its Frobenius norm.
    """
    wide = J if J.shape[1] <= J.shape[2] else J.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(wide @ wide.transpose(0, 2, 1))
    except np.linalg.LinAlgError:  # one of them is singular
        return np.zeros(len(J))
    floor: Array = 1 / np.sqrt(np.linalg.norm(inverse, axis=(1, 2)))
    return floor
