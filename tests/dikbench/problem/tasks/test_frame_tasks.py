"""Position-only and orientation-only tasks: closed forms, finite differences, the pose's parts."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import OrientationTask, PositionTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

STEP = 1e-6
TOLERANCE = 1e-5
ROBOTS = ("panda", "kinova", "planar4r")
TASKS = (PositionTask, OrientationTask)


def _at(robot: Robot, q: Array) -> Kinematics:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def _placement(robot: Robot, q: Array, frame: str | None = None) -> pin.SE3:
    index = robot.frame_id if frame is None else robot.model.getFrameId(frame)
    return _at(robot, q).placement(index).copy()


def _near(robot: Robot, random: np.random.Generator, spread: float) -> Array:
    q: Array = pin.integrate(robot.model, robot.q0, random.uniform(-spread, spread, robot.nv))
    return q


@pytest.mark.parametrize("name", ROBOTS)
@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_position_jacobian_is_the_derivative_of_the_frames_point(name: str, seed: int) -> None:
    """R J v is the velocity of the frame's origin in the world, by central differences."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q, v = _near(robot, random, 1.0), random.normal(size=robot.nv)
    task = PositionTask(target=np.zeros(3)).linearize(_at(robot, q))
    ahead, behind = (
        _placement(robot, pin.integrate(robot.model, q, sign * STEP * v)).translation
        for sign in (1, -1)
    )
    rows = list(PositionTask().rows(robot))
    own = _placement(robot, q).rotation.T @ (ahead - behind) / (2 * STEP)
    assert task.J @ v == pytest.approx(own[rows], abs=TOLERANCE)


@pytest.mark.parametrize("name", ROBOTS)
@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_log_derivative_is_that_of_the_orientation_error(name: str, seed: int) -> None:
    """d(error)/dt = -Jl J v, by central differences."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q, v = _near(robot, random, 1.0), random.normal(size=robot.nv)
    target = _placement(robot, _near(robot, random, 0.4))
    here = OrientationTask(target=target).linearize(_at(robot, q))
    ahead, behind = (
        OrientationTask(target=target)
        .linearize(_at(robot, pin.integrate(robot.model, q, sign * STEP * v)))
        .error
        for sign in (1, -1)
    )
    assert here.log_derivative is not None
    derivative = (ahead - behind) / (2 * STEP)
    assert -here.log_derivative @ here.J @ v == pytest.approx(derivative, abs=1e-4)
    assert here.log_derivative @ here.error == pytest.approx(here.error)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("kind", TASKS)
def test_following_a_task_shortens_its_error_by_gain_dt(
    kind: type[PositionTask | OrientationTask], name: str
) -> None:
    """In every row, to first order."""
    robot, random = load_robot(name), np.random.default_rng(3)
    dt, gain = 1e-5, 4.0
    q = _near(robot, random, 0.4)
    task = kind(target=_placement(robot, _near(robot, random, 0.4)), gain=gain)
    here = task.linearize(_at(robot, q))
    v = np.linalg.lstsq(here.J, here.V, rcond=None)[0]
    there = task.linearize(_at(robot, pin.integrate(robot.model, q, dt * v)))
    size = float(np.linalg.norm(here.error))
    assert np.linalg.norm(there.error) == pytest.approx((1 - gain * dt) * size, abs=1e-7)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("kind", TASKS)
def test_feed_forward_keeps_the_error_of_a_moving_target(
    kind: type[PositionTask | OrientationTask], name: str
) -> None:
    """A frame that follows the transported velocity of its target keeps its distance to it."""
    robot, random = load_robot(name), np.random.default_rng(5)
    h = 1e-6
    q, target = _near(robot, random, 0.4), _placement(robot, _near(robot, random, 0.4))
    twist = np.zeros(6)
    twist[list(robot.task_rows)] = random.normal(size=len(robot.task_rows))
    moved = target * pin.exp6(pin.Motion(h * twist))
    here = kind(gain=0.0).linearize(_at(robot, q), target, pin.Motion(twist))
    v = np.linalg.lstsq(here.J, here.V, rcond=None)[0]
    there = kind(gain=0.0).linearize(_at(robot, pin.integrate(robot.model, q, h * v)), moved)
    drift = (np.linalg.norm(there.error) - np.linalg.norm(here.error)) / h
    still = (np.linalg.norm(kind().linearize(_at(robot, q), moved).error - here.error)) / h
    assert abs(drift) < 1e-4
    assert still > 0.05  # the target itself did move


def test_a_point_on_the_elbow_is_a_frame_of_its_own() -> None:
    """The error is the vector from it to the target, in its axes; joints beyond do not move it."""
    robot = load_robot("panda")
    frame = "panda_link4"
    X = _placement(robot, robot.q0, frame)
    target = X.translation + np.array([0.1, -0.2, 0.3])
    task = PositionTask(target=target, frame=frame, priority=2).linearize(_at(robot, robot.q0))
    assert X.rotation @ task.error == pytest.approx([0.1, -0.2, 0.3])
    assert task.J.shape == (3, 7)
    assert np.all(task.J[:, 3:] == 0)
    assert np.abs(task.J[:, :3]).max() > 0.1
    assert task.priority == 2


@pytest.mark.parametrize(("kind", "wrong"), [(PositionTask, np.zeros(2)), (OrientationTask, 1.0)])
def test_a_wrong_target_is_one_line(
    kind: type[PositionTask | OrientationTask], wrong: object
) -> None:
    """It says what would have been valid."""
    robot = load_robot("planar3r")
    with pytest.raises(DikbenchError, match=r"or a pinocchio\.SE3, got"):
        kind(target=wrong).linearize(_at(robot, robot.q0))


def test_the_twist_of_a_point_is_an_error_of_one_line() -> None:
    """A body twist is in the axes of a placement, which a point does not have."""
    kinematics = _at(load_robot("panda"), load_robot("panda").q0)
    with pytest.raises(DikbenchError, match="the twist of a target needs its pinocchio"):
        PositionTask().linearize(kinematics, np.zeros(3), pin.Motion.Zero())
