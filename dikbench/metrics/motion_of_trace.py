"""The motions of traces: poses, errors and Jacobians of the recorded configurations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.errors import DikbenchError
from dikbench.metrics.motion import Motion
from dikbench.problem.tasks.rows import orientation_error
from dikbench.robots.kinematics import Kinematics, placements
from dikbench.scenario.scenario import REST_ROUNDING_S, Scenario
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
    missing = np.arange(0 if jacobians is None else trace.steps, trace.steps + 1)
    J = np.empty((trace.steps + 1, len(scenario.rows), scenario.robot.nv))
    if jacobians is not None:
        J[:-1] = jacobians
    return _motion(trace, scenario, J, missing, *_targets(trace, scenario))


def motions_of(
    traces: Sequence[Trace], scenario: Scenario, jacobians: Sequence[Array | None]
) -> list[Motion]:
    """Compute the motions of several traces of one scenario, each as `motion_of` does.

    What follows for each row of a trace by itself is computed for all rows together, so that one
    call of numpy serves all. They are parts of a whole, in which a step that is none of theirs
    leads from the end of each back to the start.

    Args:
        traces: the records, finite.
        scenario: their case.
        jacobians: see `motion_of`, of each.

    Raises:
        DikbenchError: if a trace is not one of the scenario's robot.
    """
    for trace in traces:
        _check_sizes(trace, scenario)
    nv, m = scenario.robot.nv, len(scenario.rows)
    ends = np.cumsum([trace.steps + 1 for trace in traces])
    wanted, applied = np.zeros((ends[-1], m)), np.tile(scenario.v0, (ends[-1], 1))
    J, missing = np.empty((ends[-1], m, nv)), np.ones(ends[-1], dtype=bool)
    firsts = [int(end) - trace.steps - 1 for end, trace in zip(ends, traces, strict=True)]
    for first, trace, known in zip(firsts, traces, jacobians, strict=True):
        steps = slice(first, first + trace.steps)
        wanted[steps], applied[steps] = trace.wanted, trace.applied
        if known is not None:
            J[steps], missing[steps] = known, False
    # What no series of rows reads is left empty.
    none, nothing = np.empty(0, dtype=int), np.empty(0)
    q, tau = (np.concatenate([getattr(trace, name) for trace in traces]) for name in ("q", "tau"))
    record = Trace(
        scenario.dt, q, tau, wanted[:-1], applied[:-1], applied[:-1], none, none, none, none,
        nothing, nothing, nothing, nothing,
    )  # fmt: skip
    rotations, translations = zip(*(_targets(trace, scenario) for trace in traces), strict=True)
    targets = np.concatenate(rotations), np.concatenate(translations)
    whole = _motion(record, scenario, J, np.flatnonzero(missing), *targets)
    return [_part(whole, first, trace) for first, trace in zip(firsts, traces, strict=True)]


def _motion(
    trace: Trace,
    scenario: Scenario,
    J: Array,
    missing: Indices,
    target_rotations: Array,
    target_translations: Array,
) -> Motion:
    """Compute a motion; the Jacobians (n + 1, m, nv) that are missing are written into J."""
    robot, rows = scenario.robot, np.array(scenario.rows)
    kinematics = Kinematics(robot, robot.scratch)
    for k in missing.tolist():
        kinematics.update(trace.q[k])
        J[k] = kinematics.task_jacobian(rows)
    X = placements(robot, robot.frame_id, trace.q)
    made = X[:, :3, :3], X[:, :3, 3]
    targets = target_rotations, target_translations
    points, target_points = scenario.points_at(trace.tau, made, targets)
    position, orientation = _errors(scenario, X, target_rotations, target_translations)
    return Motion(
        trace=trace,
        scenario=scenario,
        translations=X[:, :3, 3],
        position_error=position,
        orientation_error=orientation,
        jacobians=J,
        points=points,
        target_points=target_points,
    )


def _part(whole: Motion, first: int, trace: Trace) -> Motion:
    """Cut the motion of a trace that begins at an instant out of a whole."""
    rows = slice(first, first + trace.steps + 1)
    return Motion(
        trace,
        whole.scenario,
        whole.translations[rows],
        whole.position_error[rows],
        whole.orientation_error[rows],
        whole.jacobians[rows],
        whole.points[rows],
        whole.target_points[rows],
        whole,
        first,
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
    reference, tau = scenario.reference, trace.tau
    if reference.moving:  # see `Scenario.target`
        over = reference.duration - tau < REST_ROUNDING_S
        tau = np.where(over, reference.duration, tau)
    return reference.placements(tau)


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
