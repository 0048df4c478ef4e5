"""The tolerance of a scenario, above what the control period takes from an exact formulation."""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.linear_algebra import pseudo_inverse
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.scenario import Scenario

TOLERANCES_M: Final = (0.001, 0.002, 0.005, 0.01, 0.02)
"""The tolerances that a scenario may have [m]."""

FLOOR_FACTOR: Final = 1.5
"""A tolerance is at least this many times what an exact formulation leaves the path by."""

RCOND: Final = 1e-6
"""Singular values below this share of the largest count as zero."""


def tolerance_above(floor: float, default: float) -> float:
    """Return the smallest tolerance [m] that is at least the default and 1.5 times a floor [m].

    It is the largest one where none is.
    """
    least = max(default, FLOOR_FACTOR * floor)
    return next((each for each in TOLERANCES_M if each >= least), TOLERANCES_M[-1])


def sampling_floor(scenario: Scenario) -> float:
    """Compute by how much [m] the pseudo-inverse leaves a path because it is asked in steps only.

    It is the largest distance from the path of v = J^+ V (V with the correction by the gain), held
    for a control period, without any limit; infinite where the motion does not stay finite.
    """
    robot, dt, path = scenario.robot, scenario.dt, scenario.embedded_path
    assert path is not None
    kinematics, q = Kinematics(robot), scenario.q0
    made, wanted, count = [], [], round(scenario.reference.duration / dt) + 1
    for k in range(count):
        kinematics.update(q)
        target, twist = scenario.target(k * dt)
        made.append(kinematics.placement(robot.frame_id).homogeneous)
        wanted.append(target.homogeneous)
        task = scenario.first.linearize(kinematics, target, twist)
        q = pin.integrate(robot.model, q, dt * (pseudo_inverse(task.J, RCOND) @ task.V))
    X, X_d = np.array(made), np.array(wanted)
    parts = (X[:, :3, :3], X[:, :3, 3]), (X_d[:, :3, :3], X_d[:, :3, 3])
    points, _ = scenario.points_at(dt * np.arange(count, dtype=float), *parts)
    return float(path.nearest(points)[0].max()) if np.isfinite(points).all() else np.inf
