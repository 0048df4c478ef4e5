"""Tasks of the joints at rest and of the centre of mass, against differences and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from makers.problems import kinematics_at
from makers.tasks import (
    ROBOTS,
    TOLERANCE,
    error_derivative,
    random_q,
    robot_of,
    seeds,
)

from dikbench.errors import DikbenchError
from dikbench.problem.tasks import (
    CentreOfMassTask,
    DampingTask,
)
from dikbench.robots.loading import load_robot


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_damping_task_wants_joints_at_rest(name: str) -> None:
    """J = I and V = 0, one row per joint, wherever the robot is."""
    robot = robot_of(name)
    task = DampingTask(weight=0.5).linearize(
        kinematics_at(robot, random_q(robot, np.random.default_rng(9)))
    )
    assert np.array_equal(task.J, np.eye(robot.nv))
    assert np.array_equal(task.V, np.zeros(robot.nv))
    assert np.array_equal(task.error, np.zeros(robot.nv))
    assert (task.weight, task.priority) == (0.5, 2)


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_centre_of_mass_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -J at random configurations."""
    robot, random = robot_of(name), np.random.default_rng(seed)
    q = random_q(robot, random)
    task = CentreOfMassTask(random.normal(size=3))
    linearized = task.linearize(kinematics_at(robot, q))
    assert linearized.J.shape == (3, robot.nv)
    assert np.abs(linearized.J).max() > 1e-2
    assert np.allclose(error_derivative(robot, task, q), -linearized.J, atol=TOLERANCE)


def test_centre_of_mass_by_hand() -> None:
    """Three links of 1 kg, stretched along x: the mean of their middles, and its levers."""
    robot = load_robot("planar3r")
    task = CentreOfMassTask([0.5, 0.1, 0.0], gain=2.0, weight=3.0, priority=1)  # type: ignore[arg-type]
    linear = task.linearize(kinematics_at(robot, np.zeros(3)))
    middles = np.array([0.2, 0.4 + 0.15, 0.4 + 0.3 + 0.1])
    assert linear.error == pytest.approx([0.5 - middles.mean(), 0.1, 0], abs=1e-12)
    assert linear.V == pytest.approx(2 * linear.error)
    levers = [middles.sum() / 3, (0.15 + 0.4) / 3, 0.1 / 3]
    assert linear.J == pytest.approx(np.array([[0, 0, 0], levers, [0, 0, 0]]), abs=1e-12)
    assert (linear.weight, linear.priority) == (3.0, 1)


def test_centre_of_mass_task_drives_towards_its_target() -> None:
    """Following J v = V for a small step shortens the error by gain dt, in every axis."""
    robot, random = load_robot("ur5"), np.random.default_rng(10)
    for _ in range(5):
        q = random_q(robot, random, 1.0)
        reach = 0.02 * random.normal(size=3)
        task = CentreOfMassTask(kinematics_at(robot, q).centre_of_mass()[0] + reach, gain=4.0)
        before = task.linearize(kinematics_at(robot, q))
        v = np.linalg.pinv(before.J) @ before.V
        after = task.linearize(kinematics_at(robot, pin.integrate(robot.model, q, v * 1e-4)))
        assert after.error == pytest.approx((1 - 4e-4) * before.error, abs=2e-7)


def test_centre_of_mass_leaves_the_kinematics_as_they_are() -> None:
    """Placements and Jacobians taken before and after it are the same, and are no views of it."""
    robot = load_robot("panda")
    kinematics = kinematics_at(robot, robot.q0 + 0.3)
    J, X = kinematics.jacobian(robot.frame_id), kinematics.placement(robot.frame_id).copy()
    task = CentreOfMassTask(np.zeros(3)).linearize(kinematics)
    centre = kinematics.centre_of_mass()[0]
    kept = task.J.copy(), centre.copy()
    assert np.array_equal(kinematics.jacobian(robot.frame_id), J)
    assert np.array_equal(kinematics.placement(robot.frame_id).homogeneous, X.homogeneous)
    kinematics.update(robot.q0)
    kinematics.centre_of_mass()
    assert np.array_equal(task.J, kept[0])
    assert np.array_equal(centre, kept[1])


def test_a_robot_without_mass_has_no_centre_of_it() -> None:
    """An error of one line that names the robot."""
    robot = load_robot("planar3r")
    model = pin.Model(robot.model)
    model.inertias[:] = [pin.Inertia.Zero() for _ in model.inertias]
    light = replace(robot, model=model, name="light")
    with pytest.raises(DikbenchError, match="robot light has no mass"):
        CentreOfMassTask(np.zeros(3)).linearize(kinematics_at(light, light.q0))


@pytest.mark.parametrize("target", [[0, 0], [0, 0, np.nan], "here", None])
def test_a_centre_of_mass_needs_three_finite_numbers(target: object) -> None:
    """Checked where the task is made, in one line."""
    with pytest.raises(DikbenchError, match="centre-of-mass task: expected"):
        CentreOfMassTask(target)  # type: ignore[arg-type]
