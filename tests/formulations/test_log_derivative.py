"""The derivative of the logarithm: where it changes a velocity, and where it does not."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import kinematics_at, problem_at, velocity_of

from dikbench import DikProblem, PoseTask, Robot, load_robot
from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics
from formulations.weighted_qp import WeightedQp

WEIGHTS = np.array([1.0, 2.0, 0.5, 0.1, 0.3, 0.05])


def random_placement(random: np.random.Generator, angle: float) -> pin.SE3:
    """A placement that turns by an angle [rad] about a random axis and shifts by about 1 m."""
    axis = random.normal(size=3)
    rotation = pin.exp3(angle * axis / np.linalg.norm(axis))
    return pin.SE3(rotation, random.uniform(-1, 1, 3))


def towards(
    robot: Robot, q: Array, relative: pin.SE3, weight: float | Array = 1.0
) -> tuple[DikProblem, Array]:
    """The control step towards a target seen from the frame, without limits; and its Jacobian."""
    robot = robot.with_limits(position=None, velocity=None)
    kinematics = kinematics_at(robot, q)
    target = kinematics.placement(robot.frame_id) * relative
    task = PoseTask(target, gain=1.0, weight=weight).linearize(kinematics)
    problem = problem_at(robot, q, [task])
    return problem, pin.computeFrameJacobian(
        robot.model, robot.scratch, q, robot.frame_id, pin.LOCAL
    )


def qp_velocity(problem: DikProblem, damping: float, *, log_derivative: bool) -> Array:
    """What the quadratic program gives."""
    law = WeightedQp(damping=damping, log_derivative=log_derivative)
    return velocity_of(law, problem)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, 2.0, 3.0, np.pi - 1e-3, np.pi - 1e-5])
def test_log_is_a_fixed_point_of_its_derivative(angle: float) -> None:
    """Jlog6(T^-1)^-1 log6(T) = log6(T), from no turn to almost half a turn."""
    random = np.random.default_rng(0)
    for _ in range(100):
        T = random_placement(random, angle)
        e = pin.log6(T).np
        np.testing.assert_allclose(np.linalg.solve(pin.Jlog6(T.inverse()), e), e, atol=1e-7)


@pytest.mark.parametrize("name", ["ur5", "panda", "planar3r"])
def test_log_derivative_is_the_derivative_of_the_error(name: str) -> None:
    """d(error)/dt = -Jl J v for a target at rest, against finite differences."""
    robot = load_robot(name)
    random = np.random.default_rng(1)
    kinematics = Kinematics(robot)
    step = 1e-6
    for _ in range(20):
        q, v = random.uniform(-2, 2, robot.nq), random.normal(size=robot.nv)
        twist = np.zeros(6)
        twist[list(robot.task_rows)] = random.uniform(-0.8, 0.8, len(robot.task_rows))
        kinematics.update(q)
        target = kinematics.placement(robot.frame_id) * pin.exp6(twist)
        task = PoseTask(target).linearize(kinematics)
        errors = []
        for sign in (-1, 1):
            kinematics.update(pin.integrate(robot.model, q, sign * step * v))
            errors.append(PoseTask(target).linearize(kinematics).error)
        assert task.log_derivative is not None
        difference = (errors[1] - errors[0]) / (2 * step)
        np.testing.assert_allclose(difference, -task.log_derivative @ task.J @ v, atol=1e-6)


@pytest.mark.parametrize("added", [1e-4, 1e-2, 1.0])
def test_closed_form_with_log_derivative(added: float) -> None:
    """The minimum of the damped, weighted QP is v = [J + lambda Jl^-1 W^-1 Jl^-T J^-T]^-1 e."""
    robot = load_robot("ur5")
    random = np.random.default_rng(2)
    for _ in range(20):
        relative = random_placement(random, random.uniform(0.1, 2.5))
        problem, J = towards(robot, robot.q0 + random.uniform(-0.2, 0.2, 6), relative, WEIGHTS)
        e = pin.log6(relative).np
        Jl_inverse = np.linalg.inv(pin.Jlog6(relative.inverse()))
        leak = Jl_inverse @ np.diag(1 / WEIGHTS) @ Jl_inverse.T @ np.linalg.inv(J).T
        expected = np.linalg.solve(J + added * leak, e)
        v = qp_velocity(problem, added**0.5, log_derivative=True)
        np.testing.assert_allclose(v, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("added", [1e-4, 1e-2, 1.0])
def test_closed_form_without_log_derivative(added: float) -> None:
    """Without the derivative of the logarithm it is v = [J + lambda W^-1 J^-T]^-1 e."""
    robot = load_robot("ur5")
    random = np.random.default_rng(3)
    for _ in range(20):
        relative = random_placement(random, random.uniform(0.1, 2.5))
        problem, J = towards(robot, robot.q0 + random.uniform(-0.2, 0.2, 6), relative, WEIGHTS)
        e = pin.log6(relative).np
        leak = np.diag(1 / WEIGHTS) @ np.linalg.inv(J).T
        expected = np.linalg.solve(J + added * leak, e)
        v = qp_velocity(problem, added**0.5, log_derivative=False)
        np.testing.assert_allclose(v, expected, rtol=1e-6, atol=1e-8)


def test_one_undamped_task_does_not_need_it() -> None:
    """One non-singular task without damping gives J^-1 e in both forms, whatever its weights."""
    robot = load_robot("ur5")
    random = np.random.default_rng(4)
    for _ in range(20):
        relative = random_placement(random, random.uniform(0.1, 2.5))
        problem, J = towards(robot, robot.q0 + random.uniform(-0.2, 0.2, 6), relative, WEIGHTS)
        expected = np.linalg.solve(J, pin.log6(relative).np)
        for log_derivative in (True, False):
            v = qp_velocity(problem, 0.0, log_derivative=log_derivative)
            np.testing.assert_allclose(v, expected, rtol=1e-6, atol=1e-7)


def test_damping_brings_the_difference_out() -> None:
    """Under damping the two velocities differ: the equalities above are not empty."""
    robot = load_robot("ur5")
    problem, _ = towards(robot, robot.q0, random_placement(np.random.default_rng(5), 2.0), WEIGHTS)
    with_it = qp_velocity(problem, 0.1, log_derivative=True)
    without = qp_velocity(problem, 0.1, log_derivative=False)
    assert np.abs(with_it - without).max() > 1e-2
