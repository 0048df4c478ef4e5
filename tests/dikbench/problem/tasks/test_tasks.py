"""Tasks of the pose and the posture: Jacobians against finite differences, feed-forward."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from makers.problems import kinematics_at
from makers.tasks import (
    ROBOTS,
    TOLERANCE,
    error_derivative,
    predicted_derivative,
    random_q,
    robot_of,
    seeds,
    tip_of,
)

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import (
    PoseTask,
    PostureTask,
)
from dikbench.robots.loading import load_robot


@pytest.mark.parametrize("name", ROBOTS)
@settings(deadline=None, max_examples=25)
@given(seed=seeds)
def test_pose_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -(Jl J) at random configurations and targets, also far away from each other."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q = random_q(robot, random)
    target = tip_of(robot, random_q(robot, random))
    relative = tip_of(robot, q).actInv(target)
    if np.linalg.norm(pin.log3(relative.rotation)) > 3.0:
        target = tip_of(robot, q)  # beside the logarithm's cut no difference is small
    task = PoseTask(target=target)
    assert np.allclose(
        error_derivative(robot, task, q),
        predicted_derivative(task.linearize(kinematics_at(robot, q))),
        atol=TOLERANCE,
        rtol=TOLERANCE,
    )


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_pose_error_at_the_target_changes_as_the_plain_jacobian_says(name: str) -> None:
    """Where the error is zero Jl is the identity: d(error)/dv = -J."""
    robot = robot_of(name)
    random = np.random.default_rng(1)
    for _ in range(5):
        q = random_q(robot, random)
        task = PoseTask(target=tip_of(robot, q))
        assert np.allclose(
            error_derivative(robot, task, q),
            -task.linearize(kinematics_at(robot, q)).J,
            atol=TOLERANCE,
        )


def test_pose_task_on_another_frame() -> None:
    """The Jacobian and the error are that frame's: joints behind it do not move it."""
    robot, random = load_robot("panda"), np.random.default_rng(2)
    q = random_q(robot, random)
    elbow = kinematics_at(robot, random_q(robot, random, 0.3))
    target = elbow.placement(robot.model.getFrameId("panda_link4")).copy()
    task = PoseTask(target=target, frame="panda_link4")
    linearized = task.linearize(kinematics_at(robot, q))
    assert np.allclose(
        error_derivative(robot, task, q), predicted_derivative(linearized), atol=TOLERANCE
    )
    assert np.all(linearized.J[:, 4:] == 0)
    with pytest.raises(DikbenchError, match="did you mean 'panda_link4'"):
        PoseTask(target=target, frame="panda_lnk4").linearize(kinematics_at(robot, q))


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_posture_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -I for e = q* (-) q, on continuous joints too."""
    robot, random = robot_of(name), np.random.default_rng(seed)
    q = random_q(robot, random, 1.0)
    task = PostureTask(target=random_q(robot, random, 1.0))
    linearized = task.linearize(kinematics_at(robot, q))
    assert np.array_equal(linearized.J, np.eye(robot.nv))
    assert np.allclose(error_derivative(robot, task, q), -linearized.J, atol=TOLERANCE)


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_posture_task_drives_towards_its_target(name: str) -> None:
    """The sign is v = + gain e: integrating it for 1/gain arrives (science 7: two pages slip)."""
    robot = robot_of(name)
    random = np.random.default_rng(3)
    q, target = random_q(robot, random, 0.5), random_q(robot, random, 0.5)
    task = PostureTask(target=target, gain=4.0).linearize(kinematics_at(robot, q))
    arrived = pin.integrate(robot.model, q, task.V / 4.0)
    assert np.allclose(arrived, target, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_pose_task_drives_towards_its_target(name: str) -> None:
    """Following J v = V for a small step shortens the error by gain dt, in every row."""
    robot, random = load_robot(name), np.random.default_rng(4)
    dt, gain = 1e-4, 3.0
    for _ in range(5):
        q = random_q(robot, random, 0.4)
        target = tip_of(robot, pin.integrate(robot.model, q, 0.2 * random.normal(size=robot.nv)))
        task = PoseTask(target=target, gain=gain)
        here = task.linearize(kinematics_at(robot, q))
        v = np.linalg.lstsq(here.J, here.V, rcond=None)[0]
        there = task.linearize(kinematics_at(robot, pin.integrate(robot.model, q, dt * v)))
        assert np.allclose(there.error, (1 - gain * dt) * here.error, atol=1e-6)


def test_pose_error_is_the_body_twist_to_the_target() -> None:
    """X exp6(error) is the target, by the exponential of a hand-made twist."""
    robot = load_robot("ur5")
    X = tip_of(robot, robot.q0)
    twist = np.array([0.1, -0.2, 0.05, 0.4, -0.3, 0.2])
    task = PoseTask(target=X * pin.exp6(pin.Motion(twist)), gain=2.5)
    linearized = task.linearize(kinematics_at(robot, robot.q0))
    assert linearized.error == pytest.approx(twist)
    assert linearized.V == pytest.approx(2.5 * twist)


def test_a_target_of_the_step_replaces_the_tasks_own() -> None:
    """A tracking task is made once and given its target at every step."""
    robot = load_robot("ur5")
    at, X = kinematics_at(robot, robot.q0), tip_of(robot, robot.q0)
    shift = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved = X * pin.exp6(pin.Motion(shift))
    assert PoseTask().linearize(at, moved).error == pytest.approx(shift)
    assert PoseTask(target=X).linearize(at, moved).error == pytest.approx(shift)
    assert PoseTask(target=moved).linearize(at).error == pytest.approx(shift)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("seed", range(5))
def test_feed_forward_keeps_the_error_of_a_moving_target(name: str, seed: int) -> None:
    """A frame that follows the transported V_d keeps its error; with V_d as it is it would not."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    rows = np.array(robot.task_rows)
    h = 1e-5
    q = random_q(robot, random, 0.4)
    target = tip_of(robot, pin.integrate(robot.model, q, 0.3 * random.normal(size=robot.nv)))
    V_d = np.zeros(6)
    V_d[rows] = random.normal(size=len(rows))
    moved = target * pin.exp6(pin.Motion(h * V_d))
    task = PoseTask(gain=0.0)
    here = task.linearize(kinematics_at(robot, q), target, pin.Motion(V_d))

    def drift(V: Array) -> float:
        v = np.linalg.lstsq(here.J, V, rcond=None)[0]
        there = task.linearize(kinematics_at(robot, pin.integrate(robot.model, q, h * v)), moved)
        return float(np.linalg.norm(there.error - here.error)) / h

    assert drift(here.V) < 1e-3
    assert drift(V_d[rows]) > 0.02


def test_feed_forward_and_feedback_add_up() -> None:
    """V = Ad(X^-1 X_d) V_d + gain e."""
    robot, random = load_robot("panda"), np.random.default_rng(6)
    at = kinematics_at(robot, robot.q0)
    target, V_d = tip_of(robot, random_q(robot, random, 0.3)), random.normal(size=6)
    both = PoseTask(gain=3.0).linearize(at, target, pin.Motion(V_d))
    feedback = PoseTask(gain=3.0).linearize(at, target)
    forward = PoseTask(gain=0.0).linearize(at, target, pin.Motion(V_d))
    assert both.V == pytest.approx(feedback.V + forward.V)
    assert feedback.V == pytest.approx(3.0 * feedback.error)
    # The action matrix by hand: angular turned, linear turned plus lever times angular.
    relative = tip_of(robot, robot.q0).inverse() * target
    R, p = relative.rotation, relative.translation
    angular = R @ V_d[3:]
    assert forward.V == pytest.approx(np.concatenate([R @ V_d[:3] + np.cross(p, angular), angular]))


@pytest.mark.parametrize("name", ROBOTS)
def test_log_derivative_leaves_the_error_itself(name: str) -> None:
    """Jl e = e, and Jl = I at the target: nothing changes for one task at full rank."""
    robot, random = load_robot(name), np.random.default_rng(7)
    q = random_q(robot, random, 0.5)
    task = PoseTask(target=tip_of(robot, random_q(robot, random, 0.5))).linearize(
        kinematics_at(robot, q)
    )
    Jl = task.log_derivative
    assert Jl is not None
    assert np.abs(Jl - np.eye(len(Jl))).max() > 1e-3
    assert Jl @ task.error == pytest.approx(task.error)
    there = PoseTask(target=tip_of(robot, q)).linearize(kinematics_at(robot, q)).log_derivative
    assert there == pytest.approx(np.eye(len(Jl)))


def test_a_planar_arm_keeps_three_rows() -> None:
    """x, y and yaw in the axes of the tip; the error of a target in the plane is complete."""
    robot = load_robot("planar3r")
    q = np.array([0.0, np.pi / 2, 0.0])  # tip at (0.4, 0.5), pointing along +y
    target = pin.SE3(pin.utils.rotate("z", np.pi / 2), np.array([0.4, 0.7, 0.0]))
    task = PoseTask(target=target, gain=2.0).linearize(kinematics_at(robot, q))
    assert task.J == pytest.approx(np.array([[0.4, 0, 0], [0.5, 0.5, 0.2], [1, 1, 1]]))
    assert task.error == pytest.approx([0.2, 0, 0])
    assert task.V == pytest.approx([0.4, 0, 0])
    twist = pin.Motion(np.array([0, 0, 9.0, 9.0, 9.0, 0.5]))
    turned = PoseTask().linearize(kinematics_at(robot, q), target, twist)
    assert turned.V == pytest.approx([0.2, -0.2 * 0.5, 0.5])  # the lever of 0.2 m turns with it
    assert turned.log_derivative is not None
    assert turned.log_derivative.shape == (3, 3)
