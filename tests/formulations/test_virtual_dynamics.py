"""Virtual forward dynamics: the inertia of light links and a heavy hand, link by link."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench import load_robot
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import DikProblem
from dikbench.problem.tasks import LinearizedTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.robot import Robot
from dikbench.solvers.checked_solve import NoSolve


def _velocity(robot: Robot, q: Array, V: Array, parameters: str = "") -> tuple[Array, Array]:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    J = kinematics.task_jacobian()
    problem = DikProblem(
        robot, q, None, 0.01, [LinearizedTask(J, V, np.zeros(len(V)))], robot.limits.at(q)
    )
    return make_formulation(f"virtual-dynamics{parameters}").velocity(problem, NoSolve()), J


@pytest.mark.parametrize("name", ["ur5", "panda"])
@pytest.mark.parametrize("seed", range(3))
def test_links_are_point_masses_at_the_next_joint(name: str, seed: int) -> None:
    """H is summed up from the Jacobians of those points, with a small inertia about each."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q = robot.q0 + random.normal(size=robot.nv)
    V = random.normal(size=6)
    v, J = _velocity(robot, q, V, "[link_mass=0.01,link_inertia=0.003]")
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    H = J.T @ J
    for joint in range(1, model.njoints):
        last = joint == model.njoints - 1
        end = data.oMf[robot.frame_id] if last else data.oMi[joint + 1]
        columns = pin.getJointJacobian(model, data, joint, pin.WORLD)
        moved = columns[:3] + np.cross(columns[3:].T, end.translation).T
        H += 0.01 * moved.T @ moved + 0.003 * columns[3:].T @ columns[3:]
    assert v == pytest.approx(np.linalg.solve(H, J.T @ V), rel=1e-8, abs=1e-9)


def test_it_is_the_pseudo_inverse_as_the_links_lose_their_mass() -> None:
    """Away from singularities, and finite at one."""
    robot, V = load_robot("ur5"), np.array([0.1, 0.2, -0.1, 0.3, 0.1, 0.2])
    v, J = _velocity(robot, robot.q0, V, "[link_mass=1e-9,link_inertia=1e-9]")
    assert v == pytest.approx(np.linalg.solve(J, V), rel=1e-5)
    stretched = robot.q0.copy()
    stretched[4] = 0.0
    v, _ = _velocity(robot, stretched, V)
    assert np.abs(v).max() < 100
