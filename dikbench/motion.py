"""The motion behind a trace: poses, errors and Jacobians recomputed from the configurations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.kinematics import Kinematics
from dikbench.scenario import Scenario
from dikbench.trace import Trace


@dataclass(frozen=True, eq=False)
class Motion:
    """A trace and what follows from it for the task frame; n control steps.

    Attributes:
        trace: the trace.
        scenario: the case that it is a trace of.
        position_error: distance of the task frame from its target, (n + 1,) [m].
        orientation_error: angle between them, (n + 1,) [rad].
        achieved: twist of the task frame under the applied velocity, (n, m) [m/s; rad/s].
        sigma_min: smallest singular value of the task Jacobian (m, rad), (n + 1,).
    """

    trace: Trace
    scenario: Scenario
    position_error: Array
    orientation_error: Array
    achieved: Array
    sigma_min: Array


def recompute(trace: Trace, scenario: Scenario) -> Motion:
    """Compute the motion of the task frame from the recorded configurations and velocities."""
    robot, reference = scenario.robot, scenario.reference
    kinematics, rows = Kinematics(robot), np.array(robot.task_rows)
    n = trace.steps
    position, orientation = np.empty(n + 1), np.empty(n + 1)
    J = np.empty((n + 1, len(rows), robot.nv))
    for k, q in enumerate(trace.q):
        kinematics.update(q)
        X = kinematics.placement(robot.frame_id)
        X_d = reference.placement(float(trace.tau[k]))
        position[k] = np.linalg.norm(X.translation - X_d.translation)
        orientation[k] = np.linalg.norm(pin.log3(X.rotation.T @ X_d.rotation))
        J[k] = kinematics.jacobian(robot.frame_id)[rows]
    return Motion(
        trace=trace,
        scenario=scenario,
        position_error=position,
        orientation_error=orientation,
        achieved=np.einsum("kij,kj->ki", J[:n], trace.applied),
        sigma_min=np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1], dtype=float),
    )
