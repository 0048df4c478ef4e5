"""NEO: least squares that are rewarded for manipulability."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import kinematics_at, problem_at, random_step, random_steps, velocity_of

from dikbench.arrays import Array
from dikbench.problem.tasks import LinearizedTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.testing.states import SINGULAR
from formulations.manipulability import manipulability_gradient


def test_neo_without_its_reward_is_damped_least_squares() -> None:
    """Far from limits: min lambda ||v||^2 + ||V - J v||^2 / ||e||_1."""
    robot = load_robot("panda").with_limits(position=None, velocity=None)
    random = np.random.default_rng(3)
    for _ in range(20):
        problem = random_step(robot, random, 0.1, second="none")
        task = problem.tasks[0]
        task.error = random.uniform(-0.05, 0.05, 6)
        e = float(np.abs(task.error).sum())
        damped = velocity_of(f"dls[damping={float(np.sqrt(0.01 * e))!r}]", problem)
        assert velocity_of("neo[manipulability_gain=0]", problem) == pytest.approx(damped, abs=1e-6)


def test_neos_dampers_reach_over_a_share_of_each_range() -> None:
    """Half of it: one of the two is active wherever a joint is, to rest at the stop distance.

    v_i <= eta (d - rho_s)/(range/2 - rho_s), d to the nearer limit; none towards the other.
    """
    robot = load_robot("panda").with_limits(velocity=None)
    position = robot.limits.position
    assert position is not None
    law = "neo[damper_gain=0.5,stop_distance=0.001,influence_share=0.5,manipulability_gain=0]"
    random, active, fast = np.random.default_rng(5), 0, 0
    half = (position.upper - position.lower) / 2
    for _ in range(20):
        q = random.uniform(position.lower, position.upper)
        J = kinematics_at(robot, q).task_jacobian()
        task = LinearizedTask(J, J @ random.uniform(-3, 3, 7), np.full(6, 0.01))
        v = velocity_of(law, problem_at(robot, q, [task]))
        to_upper, to_lower = position.upper - q, q - position.lower
        bound = 0.5 * np.maximum(np.minimum(to_upper, to_lower) - 0.001, 0) / (half - 0.001)
        towards = np.where(to_upper < to_lower, v, -v)
        assert (towards <= bound + 1e-6).all()
        active += int((towards > bound - 1e-6).sum())
        fast += int((towards < -0.5).sum())
    assert active > 20
    assert fast > 20


def test_neos_reward_raises_the_manipulability() -> None:
    """To first order, compared with the same program without it."""
    better = 0
    for problem in random_steps(30, 0.05, "none"):
        problem.tasks[0].error = np.full(6, 0.1)
        J = problem.tasks[0].J
        gradient = manipulability_gradient(J)
        with_it, without = (
            velocity_of(f"neo[manipulability_gain={gain}]", problem) for gain in (1, 0)
        )
        better += float(gradient @ with_it) > float(gradient @ without)
    assert better == 30


@pytest.mark.parametrize("name", ["panda", "ur5", "kinova", "planar3r"])
def test_manipulability_gradient_is_the_derivative(name: str) -> None:
    """By central differences."""
    robot, random = load_robot(name), np.random.default_rng(4)
    kinematics, rows = Kinematics(robot), list(robot.task_rows)

    def manipulability(q: Array) -> float:
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)[rows]
        return float(np.sqrt(np.linalg.det(J @ J.T)))

    for _ in range(5):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-0.5, 0.5, robot.nv))
        kinematics.update(q)
        found = manipulability_gradient(kinematics.jacobian(robot.frame_id)[rows].copy())
        step = 1e-6 * np.eye(robot.nv)
        expected = [
            (
                manipulability(pin.integrate(robot.model, q, s))
                - manipulability(pin.integrate(robot.model, q, -s))
            )
            / 2e-6
            for s in step
        ]
        assert found == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("eps", [1e-2, 1e-5, 1e-8, 1e-11], ids=str)
def test_manipulability_gradient_near_a_singularity(eps: float) -> None:
    """On a planar arm w = l_1 l_2 |sin q_2|: next to the stretched arm it rises with q_2."""
    robot = load_robot("planar3r")
    kinematics, rows = Kinematics(robot), list(robot.task_rows)
    kinematics.update(np.array([0.4, eps, 0.7]))
    found = manipulability_gradient(kinematics.jacobian(robot.frame_id)[rows])
    kinematics.update(np.array([0.4, np.pi / 2, 0.7]))
    J = kinematics.jacobian(robot.frame_id)[rows]
    slope = abs(float(np.linalg.det(J))) * np.cos(eps)  # l_1 l_2 cos q_2
    assert found == pytest.approx([0, slope, 0], abs=1e-4 * slope)


def test_manipulability_has_no_gradient_at_a_singularity() -> None:
    """Where it is zero, up to rounding too, and where the rows are more than the joints."""
    assert np.array_equal(manipulability_gradient(np.zeros((6, 7))), np.zeros(7))
    tall = np.random.default_rng(0).normal(size=(6, 5))
    assert np.array_equal(manipulability_gradient(tall), np.zeros(5))
    for name, places in SINGULAR.items():
        robot = load_robot(name)
        kinematics = Kinematics(robot)
        for q in places:
            kinematics.update(np.array(q, dtype=float))
            J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
            assert np.array_equal(manipulability_gradient(J), np.zeros(robot.nv))
