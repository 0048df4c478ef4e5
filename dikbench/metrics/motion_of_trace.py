"""The motion of a trace: poses, errors and Jacobians of the recorded configurations."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics.motion import Motion
from dikbench.problem.tasks.rows import orientation_error
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace


def motion_of(trace: Trace, scenario: Scenario, jacobians: Array | None = None) -> Motion:
    """Compute the motion of the task frame from the recorded configurations and velocities.

    Args:
        trace: the record.
        scenario: the case of the trace.
        jacobians: the task Jacobians at all configurations but the last, (n, m, nv), if the run has
            computed them; otherwise they are computed, with the same result.

    Raises:
        DikbenchError: if the trace is not one of the scenario's robot.
    """
    _check_sizes(trace, scenario)
    robot, frame = scenario.robot, scenario.robot.frame_id
    n, rows = trace.steps, np.array(scenario.rows)
    X = placements(robot, frame, trace.q)
    kinematics, J = Kinematics(robot), np.empty((n + 1, len(rows), robot.nv))
    known = 0 if jacobians is None else n
    if jacobians is not None:
        J[:n] = jacobians
    for k, q in enumerate(trace.q[known:], start=known):
        kinematics.update(q)
        J[k] = kinematics.task_jacobian(rows)
    target_rotations, target_translations = _targets(trace, scenario)
    made = X[:, :3, :3], X[:, :3, 3]
    points, at = scenario.points_at(trace.tau, made, (target_rotations, target_translations))
    position, orientation = _errors(scenario, X, target_rotations, target_translations)
    return Motion(
        trace=trace,
        scenario=scenario,
        translations=X[:, :3, 3],
        position_error=position,
        orientation_error=orientation,
        jacobians=J,
        points=points,
        target_points=at,
    )


def _errors(
    scenario: Scenario, X: Array, target_rotations: Array, target_translations: Array
) -> tuple[Array, Array]:
    """Compute the errors of position [m] and orientation [rad] at each instant, (n + 1,) each.

    Where some rows of either are asked for only (of an arm that could move the others), they are
    the lengths of these rows of the error; NaN where none is.
    """
    robot, rows = scenario.robot, scenario.rows
    linear, angular = [row for row in rows if row < 3], [row - 3 for row in rows if row >= 3]
    nothing = np.full(len(X), np.nan)
    position, orientation = nothing, nothing
    R, away = X[:, :3, :3], target_translations - X[:, :3, 3]
    in_space = 2 in robot.movable_rows
    if linear:
        if len(linear) < 3 and in_space and robot.task_axes == "body":
            away = np.einsum("kji,kj->ki", R, away)
        kept = linear if len(linear) < 3 and in_space else slice(None)
        position = np.linalg.norm(away[:, kept], axis=1)
    if angular and (len(angular) == 3 or not in_space):
        orientation = rotation_angles(R, target_rotations)
    elif angular:
        turns = [
            orientation_error(robot, each.T @ wanted, each, angular)
            for each, wanted in zip(R, target_rotations, strict=True)
        ]
        orientation = np.linalg.norm(turns, axis=1)
    return position, orientation


def _check_sizes(trace: Trace, scenario: Scenario) -> None:
    """Check that a trace has as many coordinates as the scenario's robot."""
    robot = scenario.robot
    sizes = {"q": robot.nq, "applied": robot.nv}
    for name, size in sizes.items():
        shape = getattr(trace, name).shape
        if shape[1:] != (size,):
            raise DikbenchError(
                f"trace of another robot: {name} has shape {shape}; "
                f"valid for {robot.name}: (steps, {size})"
            )


def _targets(trace: Trace, scenario: Scenario) -> tuple[Array, Array]:
    """Return the rotations (n + 1, 3, 3) and translations (n + 1, 3) [m] of a trace's targets."""
    n = trace.steps
    if n <= scenario.steps and np.array_equal(trace.tau, np.arange(n + 1) * scenario.dt):
        rotations, translations = scenario.target_arrays
        return rotations[: n + 1], translations[: n + 1]
    placements = [scenario.target(float(tau))[0] for tau in trace.tau]
    return np.array([X.rotation for X in placements]), np.array([X.translation for X in placements])


def rotation_angles(first: Array, second: Array) -> Array:
    """Compute the angle of R1^T R2 for each pair of rotations (n, 3, 3), (n,) [rad].

    It is atan2 of its sine, half the length of the axial vector, and its cosine, (trace - 1)/2.
    """
    R = np.einsum("kji,kjl->kil", first, second)
    axial = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    cosine = np.trace(R, axis1=1, axis2=2) - 1
    angles: Array = np.arctan2(np.linalg.norm(axial, axis=1), cosine)
    return angles
