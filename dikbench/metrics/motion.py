"""The motion behind a trace: poses, errors and Jacobians recomputed from the configurations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.metrics.along_path import follow_path
from dikbench.problem.constraints import CollisionConstraint, TorqueConstraint
from dikbench.problem.progress import progress, row_weights
from dikbench.problem.tasks import PostureTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import Interval
from dikbench.robots.robot import Robot
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace

STRIDE: Final = 16
"""One in so many singular values is computed to begin with."""

BLUR: Final = 1e-6
"""How much rounding may change a small singular value (m, rad) when its matrix is squared."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A trace and what follows from it for the task frame; n control steps.

    Attributes:
        trace: the trace.
        scenario: the case that it is a trace of.
        translations: origin of the task frame in the world, (n + 1, 3) [m].
        position_error: distance of the task frame from its target, (n + 1,) [m]; NaN where the
            task is about the orientation only.
        orientation_error: angle between them, (n + 1,) [rad]; NaN where the task is about the
            position only.
        jacobians: task Jacobians (m, rad), (n + 1, m, nv).
    """

    trace: Trace
    scenario: Scenario
    translations: Array
    position_error: Array
    orientation_error: Array
    jacobians: Array

    @cached_property
    def achieved(self) -> Array:
        """Twist of the task frame under the applied velocity, (n, m) [m/s; rad/s]."""
        twists: Array = np.einsum("kij,kj->ki", self.jacobians[:-1], self.trace.applied)
        return twists

    @cached_property
    def progress(self) -> Array:
        """Share of the wanted motion that each step made, but for dwells, (k,) (see `progress`)."""
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
        """How far the joint that is farthest is outside its position limits, (n + 1,) [rad or m].

        At the start and after each step; 0 inside, and where no limits are in force.
        """
        limits = self.scenario.robot.limits
        return _worst_excess(self.trace.q[:, limits.q_index], limits.position)

    @cached_property
    def velocity_excess(self) -> Array:
        """Likewise of the velocity limits, in each step, (n,) [rad/s or m/s]."""
        return _worst_excess(self.trace.applied, self.scenario.robot.limits.velocity)

    @cached_property
    def acceleration_excess(self) -> Array:
        """Likewise of the acceleration limits, into each step, (n,) [rad/s^2 or m/s^2]."""
        return _worst_excess(self.accelerations, self.scenario.robot.limits.acceleration)

    @cached_property
    def contour_error(self) -> Array:
        """Distance of the task frame from the path of the reference, (n + 1,) [m].

        The nearest point of the whole path counts, whenever the reference is there; of a target
        that has no path, the target. NaN where the task is about the orientation only.
        """
        path = self.scenario.path
        if path is None or np.isnan(self.position_error[0]):
            return self.position_error
        return path.distances(self.translations)

    @cached_property
    def along(self) -> Array:
        """Length of the way along the path that the frame has come, (n + 1,) [m].

        To the nearest point of the path, never back (see `follow_path`); empty where there is no
        way to go, or the task is about the orientation only.
        """
        path, tau = self.scenario.path, self.trace.tau
        if path is None or path.is_point or np.isnan(self.position_error[0]):
            return np.empty(0)
        return follow_path(path, self.translations, np.interp(tau, path.times, path.arcs))

    @cached_property
    def path_done(self) -> float:
        """Share of the path that lies behind the frame at the end; NaN where there is none."""
        path = self.scenario.path
        return float(self.along[-1] / path.arcs[-1]) if path and len(self.along) else np.nan

    @cached_property
    def lag(self) -> Array:
        """Delay along the path, (n + 1,) [s].

        The nominal time that the reference takes on its way from the nearest point of the path (see
        `follow_path`) to the target, without dwells, in which nothing is to be caught up; and, as a
        path-indexed target waits, by how much it is late itself: trace time - tau, 0 where the
        reference moves on with the clock. Where the reference is slow, a small distance is a long
        delay. NaN where the task is about the orientation only, or there is no way to go.
        """
        path, tau = self.scenario.path, self.trace.tau
        if path is None or not len(self.along):
            return np.full(len(tau), np.nan)
        target = np.interp(tau, path.times, path.moving_times)
        way = target - np.interp(self.along, path.arcs, path.moving_times)
        lag: Array = np.maximum(way, 0.0) + (self.trace.dt * np.arange(len(tau)) - tau)
        return lag

    @cached_property
    def second_task_error(self) -> Array:
        """Norm of the error of the second tasks, (n + 1,) [their units]; empty where there is none.

        Postures do not count: they only choose where a redundant arm has a choice.
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
        """Smallest distance that a collision constraint is about, (n + 1,) [m]; else empty."""
        return self._least(self._smallest)

    @cached_property
    def clearance(self) -> Array:
        """Smallest distance less the margin that its constraint keeps, (n + 1,) [m]; else empty."""
        return self._least(
            [
                distances - c.margin
                for distances, c in zip(self._smallest, self._collisions, strict=True)
            ]
        )

    @cached_property
    def distance_remainders(self) -> Array:
        """By how much distances fell below what the rows of each step predict, (n,) [m].

        The largest over the pairs that had rows (see `CollisionConstraint.remainders`); else empty.
        """
        parts = [c.remainders(self._robot, self.trace.q) for c in self._collisions]
        return 0.0 - self._least([part.min(axis=1, initial=0.0) for part in parts])

    @cached_property
    def torque_usage(self) -> Array:
        """Largest joint torque over its limit in each step, (n,); empty where none is limited."""
        robot, trace = self._robot, self.trace
        limit = robot.limits.effort
        for constraint in self.scenario.constraints:
            if isinstance(constraint, TorqueConstraint) and limit is not None:
                v = self.velocities
                torques = constraint.torques(robot, trace.q[:-1], v[1:], v[:-1], trace.dt)
                usage: Array = limit.usage(torques).max(axis=1, initial=0.0)
                return usage
        return np.empty(0)

    @cached_property
    def _smallest(self) -> list[Array]:
        """Smallest distance of each collision constraint, (n + 1,) [m] each."""
        return [c.distances(self._robot, self.trace.q) for c in self._collisions]

    @property
    def _robot(self) -> Robot:
        return self.scenario.robot

    @property
    def _collisions(self) -> list[CollisionConstraint]:
        return [c for c in self.scenario.constraints if isinstance(c, CollisionConstraint)]

    def _least(self, parts: list[Array]) -> Array:
        """The smallest of arrays of one shape, element by element; empty where there is none."""
        least: Array = np.min(parts, axis=0) if parts else np.empty(0)
        return least

    @cached_property
    def sigma_min(self) -> float:
        """Smallest singular value of the task Jacobian (m, rad) on the way."""
        return _smallest_singular_value(self.jacobians)


def _worst_excess(values: Array, interval: Interval | None) -> Array:
    """How far the joint that is farthest lies outside an interval, of values (k, nv), (k,)."""
    if interval is None:
        return np.zeros(len(values))
    outside: Array = np.maximum(values - interval.upper, interval.lower - values)
    worst: Array = outside.max(axis=1, initial=0.0)
    return worst


def _smallest_singular_value(J: Array) -> float:
    """The smallest singular value that a sequence of matrices (k, m, n) comes to.

    A singular value changes by at most the norm of the change of its matrix (Weyl): a few known
    ones rule out most of a motion, and a cheap bound most of the rest.
    """
    steps = np.arange(len(J))
    nearest = np.minimum(steps - steps % STRIDE + STRIDE // 2, len(J) - 1)
    sampled = np.unique(nearest)
    values = np.linalg.svd(J[sampled], compute_uv=False)[:, -1]
    least = float(values.min())
    changes = np.diff(J, axis=0).reshape(len(J) - 1, J[0].size)
    way = np.concatenate([[0.0], np.cumsum(np.sqrt(np.einsum("ki,ki->k", changes, changes)))])
    bound = values[np.searchsorted(sampled, nearest)] - np.abs(way - way[nearest])
    open_ = J[bound < least]
    if not len(open_):
        return least
    candidates = open_[_singular_value_floor(open_) <= least + BLUR]
    return float(np.linalg.svd(candidates, compute_uv=False)[:, -1].min(initial=least))


def _singular_value_floor(J: Array) -> Array:
    """A value that the smallest singular value of each J (k, m, n) is not below, but for rounding.

    1/sigma_min^2 is the largest eigenvalue of (J J^T)^-1 and thus at most its Frobenius norm, which
    costs a quarter of the singular values.
    """
    wide = J if J.shape[1] <= J.shape[2] else J.transpose(0, 2, 1)
    try:
        inverse = np.linalg.inv(wide @ wide.transpose(0, 2, 1))
    except np.linalg.LinAlgError:  # one of them is singular to the last bit
        return np.zeros(len(J))
    floor: Array = 1 / np.sqrt(np.linalg.norm(inverse, axis=(1, 2)))
    return floor


def recompute(trace: Trace, scenario: Scenario, jacobians: Array | None = None) -> Motion:
    """Compute the motion of the task frame from the recorded configurations and velocities.

    Args:
        trace: what was recorded.
        scenario: the case that it is a trace of.
        jacobians: the task Jacobians at its configurations but the last, (n, m, nv), where they are
            at hand from the run; they would come out the same.
    """
    robot, frame = scenario.robot, scenario.robot.frame_id
    model, data, n = robot.model, robot.model.createData(), trace.steps
    rows = np.array(scenario.rows)
    placements = []
    for q in trace.q:
        pin.forwardKinematics(model, data, q)
        placements.append(pin.updateFramePlacement(model, data, frame).homogeneous)
    X = np.array(placements)
    kinematics, J = Kinematics(robot), np.empty((n + 1, len(rows), robot.nv))
    known = 0 if jacobians is None else n
    if jacobians is not None:
        J[:n] = jacobians
    for k, q in enumerate(trace.q[known:], start=known):
        kinematics.update(q)
        J[k] = kinematics.jacobian(frame)[rows]
    wanted_rotations, wanted_translations = _wanted(trace, scenario)
    return Motion(
        trace=trace,
        scenario=scenario,
        translations=X[:, :3, 3],
        position_error=(
            np.linalg.norm(X[:, :3, 3] - wanted_translations, axis=1)
            if rows[0] < 3
            else np.full(n + 1, np.nan)
        ),
        orientation_error=(
            rotation_angles(X[:, :3, :3], wanted_rotations)
            if rows[-1] >= 3
            else np.full(n + 1, np.nan)
        ),
        jacobians=J,
    )


def _wanted(trace: Trace, scenario: Scenario) -> tuple[Array, Array]:
    """Rotations (n + 1, 3, 3) and translations (n + 1, 3) of the reference at the trace's tau."""
    n = trace.steps
    if n <= scenario.steps and np.array_equal(trace.tau, np.arange(n + 1) * scenario.dt):
        rotations, translations = scenario.target_arrays
        return rotations[: n + 1], translations[: n + 1]
    placements = [scenario.reference.placement(float(tau)) for tau in trace.tau]
    return np.array([X.rotation for X in placements]), np.array([X.translation for X in placements])


def rotation_angles(first: Array, second: Array) -> Array:
    """Angle of R1^T R2 for each pair of rotations (n, 3, 3), (n,) [rad].

    atan2 of its sine, half the length of the axial vector, and its cosine, (trace - 1)/2.
    """
    R = np.einsum("kji,kjl->kil", first, second)
    axial = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    cosine = np.trace(R, axis1=1, axis2=2) - 1
    angles: Array = np.arctan2(np.linalg.norm(axial, axis=1), cosine)
    return angles
