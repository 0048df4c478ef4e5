"""The step of Haviland & Corke's second tutorial, against the formulas of their notebook."""

from __future__ import annotations

import numpy as np
import pytest

from dikbench import load_robot
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import DikProblem
from dikbench.problem.tasks import LinearizedTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot
from dikbench.solvers.checked_solve import NoSolve
from formulations.manipulability import manipulability_gradient

PANDA = load_robot("panda")
STOP = 0.001


def _sigma(robot: Robot, q: Array) -> Array:
    """Sum up the push away from the limits as the notebook does, joint by joint."""
    position = robot.limits.position
    assert position is not None
    found = np.zeros(robot.nv)
    for i, (low, high) in enumerate(zip(position.lower, position.upper, strict=True)):
        influence = 0.5 * (high - low)
        if q[i] - low <= influence:
            found[i] = -((q[i] - low - influence) ** 2) / (STOP - influence) ** 2
        if high - q[i] <= influence:
            found[i] = (high - q[i] - influence) ** 2 / (STOP - influence) ** 2
    return -found


def _asked(robot: Robot, q: Array, parameters: str) -> tuple[Array, Array, Array]:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    J = kinematics.task_jacobian()
    error = np.random.default_rng(1).normal(size=6)
    problem = DikProblem(robot, q, None, 1.0, [LinearizedTask(J, error, error)], robot.limits.at(q))
    law = make_formulation(f"lm-null-space[{parameters}]")
    return law.velocity(problem, NoSolve()), J, error


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("outside", [0.0, 0.5])
def test_the_step_is_the_notebooks(seed: int, outside: float) -> None:
    """A step (J^T J + W_n)^-1 J^T e + N (Sigma/lambda_Sigma + J_m/lambda_m), outside too."""
    position = PANDA.limits.position
    assert position is not None
    q = np.random.default_rng(seed).uniform(position.lower - outside, position.upper + outside)
    v, J, e = _asked(
        PANDA,
        q,
        "error_factor=0.1,damping=0.01,limit_gain=0.5,manipulability_gain=0.1,influence_share=0.5",
    )
    W = (0.1 * 0.5 * e @ e + 1e-4) * np.eye(7)
    null_space = np.eye(7) - np.linalg.pinv(J) @ J
    push = _sigma(PANDA, q) / 2.0 + manipulability_gradient(J) / 10.0
    expected = np.linalg.solve(J.T @ J + W, J.T @ e) + null_space @ push
    assert v == pytest.approx(expected, abs=1e-9)
    assert np.linalg.norm(null_space @ push) > 1e-3


def test_an_arm_without_a_null_space_steps_as_lm_does() -> None:
    """Six joints, six rows: nothing is left for the push."""
    robot = load_robot("ur5")
    v, J, e = _asked(robot, robot.q0, "error_factor=0,damping=0,limit_gain=5")
    assert v == pytest.approx(np.linalg.solve(J, e))
