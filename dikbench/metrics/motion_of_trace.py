"""The motion of a trace: poses, errors and Jacobians of the recorded configurations."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics.motion import Motion
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
        J[k] = kinematics.jacobian(frame)[rows]
    target_rotations, target_translations = _targets(trace, scenario)
    return Motion(
        trace=trace,
        scenario=scenario,
        translations=X[:, :3, 3],
        position_error=(
            np.linalg.norm(X[:, :3, 3] - target_translations, axis=1)
            if rows[0] < 3
            else np.full(n + 1, np.nan)
        ),
        orientation_error=(
            rotation_angles(X[:, :3, :3], target_rotations)
            if rows[-1] >= 3
            else np.full(n + 1, np.nan)
        ),
        jacobians=J,
        points=scenario.embedding.points(X[:, :3, :3], X[:, :3, 3]),
        target_points=scenario.embedding.points(target_rotations, target_translations),
    )


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
