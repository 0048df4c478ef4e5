"""A motion: a trace, and what follows from it for the task frame, its limits and its distances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dikbench.arrays import Array, Indices, Mask
from dikbench.metrics.along_path import AlongPath
from dikbench.metrics.smallest_singular_value import smallest_singular_value
from dikbench.problem.constraints import CollisionConstraint, TorqueConstraint
from dikbench.problem.progress import off_course, progress, row_weights
from dikbench.problem.tasks import PostureTask
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.robots.limits import Interval
from dikbench.scenario.reference.path import NEGLIGIBLE_LENGTH_M
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace


def is_finite(trace: Trace) -> bool:
    """Whether every number of a trace that motions are made of is finite."""
    recorded = (trace.q, trace.tau, trace.wanted, trace.applied)
    return all(bool(np.isfinite(part).all()) for part in recorded)


def _by_rows(values: Callable[[Motion], Array]) -> cached_property[Array]:
    """Make a series of values that each follow from a step, or an instant and the step to it.

    That of a part is cut out of the whole's, so that one call of numpy serves many trials.
    """

    def cut(motion: Motion) -> Array:
        if motion.whole is None:
            return values(motion)
        found: Array = getattr(motion.whole, values.__name__)
        first, of_steps = motion.first, len(found) == motion.whole.trace.steps
        return found[first : first + motion.trace.steps + (not of_steps)]

    cut.__doc__ = values.__doc__
    return cached_property(cut)


@dataclass(frozen=True, eq=False)
class Motion:
    """A trace of n control steps and quantities derived from it, computed on first use.

    It may be part of a whole: many motions of one scenario, one after the other, each beginning
    anew at the start with a step that is none of any of them (see `motions_of`).

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
        whole: the motion that it is part of, or None.
        first: number of the instant of the whole at which it begins.
    """

    trace: Trace
    scenario: Scenario
    translations: Array
    position_error: Array
    orientation_error: Array
    jacobians: Array
    points: Array
    target_points: Array
    whole: Motion | None = None
    first: int = 0

    def series(self, values: Callable[[Motion], Array | Mask]) -> Array | Mask:
        """Compute a series of the motion, on first use."""
        if values not in self._series:
            self._series[values] = values(self)
        return self._series[values]

    @cached_property
    def _series(self) -> dict[Callable[[Motion], Array | Mask], Array | Mask]:
        """The series that were asked for, by what computes them."""
        return {}

    @_by_rows
    def achieved(self) -> Array:
        """Twist of the task frame under the applied velocity, (n, m) [m/s; rad/s]."""
        twists: Array = np.einsum("kij,kj->ki", self.jacobians[:-1], self.trace.applied)
        return twists

    @cached_property
    def progress(self) -> Array:
        """Share of the desired motion that each step but dwells made, (k,) (see `progress`)."""
        return self._alpha[~np.isnan(self._alpha)]

    @_by_rows
    def _alpha(self) -> Array:
        """The same in every step, (n,); NaN in dwells."""
        weights = row_weights(self.scenario.rows, self.scenario.characteristic_length)
        return progress(self.trace.wanted, self.achieved, weights)

    @_by_rows
    def direction_error(self) -> Array:
        """Angle between the achieved and the desired twist of each step, (n,) [rad].

        NaN in a dwell and where the robot stands still (see `off_course`).
        """
        weights = row_weights(self.scenario.rows, self.scenario.characteristic_length)
        return off_course(self.trace.wanted, self.achieved, weights)

    @_by_rows
    def velocities(self) -> Array:
        """Joint velocity at the start and in each step, (n + 1, nv) [rad/s]."""
        return np.vstack([self.scenario.v0, self.trace.applied])

    @_by_rows
    def accelerations(self) -> Array:
        """Joint acceleration into each step, (n, nv) [rad/s^2]."""
        return self.jumps / self.trace.dt

    @_by_rows
    def jumps(self) -> Array:
        """Change of the joint velocity into each step, (n, nv) [rad/s]."""
        return np.diff(self.velocities, axis=0)

    @cached_property
    def acceleration_changes(self) -> Array:
        """Change of the acceleration from each step to the next, (n - 1, nv) [rad/s^2]."""
        return np.diff(self.accelerations, axis=0)

    @_by_rows
    def position_excess(self) -> Array:
        """Largest distance of a joint outside its position limits, (n + 1,) [rad or m].

        At the start and after each step; 0 inside, and where no limits are in force.
        """
        limits = self.scenario.robot.limits
        return _worst_excess(self.trace.q[:, limits.q_index], limits.position)

    @_by_rows
    def velocity_excess(self) -> Array:
        """The same for the velocity limits, in each step, (n,) [rad/s or m/s]."""
        return _worst_excess(self.trace.applied, self.scenario.robot.limits.velocity)

    @_by_rows
    def velocity_usage(self) -> Array:
        """Largest joint speed over its limit in each step, (n,); 0 without limits."""
        limit = self.scenario.robot.limits.velocity
        if limit is None:
            return np.zeros(self.trace.steps)
        usage: Array = limit.usage(self.trace.applied).max(axis=1, initial=0.0)
        return usage

    @_by_rows
    def acceleration_excess(self) -> Array:
        """The same for the acceleration limits, into each step, (n,) [rad/s^2 or m/s^2]."""
        return _worst_excess(self.accelerations, self.scenario.robot.limits.acceleration)

    @_by_rows
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

    @_by_rows
    def tracking_error(self) -> Array:
        """Distance from the target in position and orientation, (n + 1,) [m] (see `Embedding`).

        Of several frames of the first priority the one that is farthest from its target counts.
        """
        away = np.linalg.norm(self.points - self.target_points, axis=1)
        farthest: Array = np.maximum(away, self._held_apart[0])
        return farthest

    @_by_rows
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
        if self.whole is not None:
            rows = slice(self.first, self.first + self.trace.steps + 1)
            away, pieces, shares = self.whole.nearest_on_path
            return away[rows], pieces[rows], shares[rows]
        path = self.scenario.embedded_path
        assert path is not None
        return path.nearest(self.points)

    @_by_rows
    def along_and_across(self) -> Array:
        """Length of each step of x along the tangent of the path and across it, (n, 2) [m].

        The tangent is the mean of those where it is nearest to the step's beginning and its end.
        """
        path = self.scenario.embedded_path
        assert path is not None
        steps, tangents = np.diff(self.points, axis=0), path.tangents(*self.nearest_on_path[1:])
        before, after = tangents[:-1], tangents[1:]
        turned_back = np.einsum("ij,ij->i", before, after) < 0
        means = before + np.where(turned_back, -1.0, 1.0)[:, None] * after
        sizes = np.linalg.norm(means, axis=1, keepdims=True)
        means /= np.where(sizes > 0, sizes, 1.0)
        along = np.einsum("ij,ij->i", steps, means)
        across = np.linalg.norm(steps - along[:, None] * means, axis=1)
        return np.stack([along, across], axis=1)

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
        return smallest_singular_value(self.jacobians)

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
