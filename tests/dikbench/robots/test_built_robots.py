"""Robots that are built in code: against their tables and closed forms."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array
from dikbench.robots.catalogue import LWR_TABLE
from dikbench.robots.denavit_hartenberg import denavit_hartenberg_arm
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot


def _placement(robot: Robot, q: Array) -> pin.SE3:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.placement(robot.frame_id).copy()


def _row(theta: float, a: float, alpha: float, d: float) -> Array:
    """A row of a Denavit-Hartenberg table as a homogeneous matrix, written out."""
    ct, s, ca, sa = cos(theta), sin(theta), cos(alpha), sin(alpha)
    return np.array(
        [
            [ct, -s * ca, s * sa, a * ct],
            [s, ct * ca, -ct * sa, a * s],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
    )


angles = st.floats(-3, 3)


@settings(deadline=None)
@given(q=arrays(float, 3, elements=angles), twist=arrays(float, 3, elements=angles))
def test_an_arm_is_the_product_of_its_rows(q: Array, twist: Array) -> None:
    """For any table: lengths, offsets and turns."""
    table = tuple((0.1 * n + 0.2, float(twist[n]), 0.3 - 0.1 * n) for n in range(3))
    model = denavit_hartenberg_arm(
        "arm", table, position_limits=(1, 2, 3), velocity_limits=(4, 5, 6)
    )
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    expected = np.eye(4)
    for theta, row in zip(q, table, strict=True):
        expected = expected @ _row(float(theta), *row)
    X = pin.updateFramePlacement(model, data, model.getFrameId("tool")).homogeneous
    assert expected == pytest.approx(X, abs=1e-12)
    assert list(model.upperPositionLimit) == [1, 2, 3]
    assert list(model.lowerPositionLimit) == [-1, -2, -3]
    assert list(model.velocityLimit) == [4, 5, 6]


def test_the_lwr_stands_upright_at_zero() -> None:
    """All its lengths above each other: 0.3105 + 0.40 + 0.39 + 0.078 m."""
    robot = load_robot("lwr")
    assert _placement(robot, np.zeros(7)).translation == pytest.approx([0, 0, 1.1785])
    assert len(LWR_TABLE) == 7
    limits = robot.limits
    assert limits.position is not None
    assert limits.velocity is not None
    degrees = [170, 120, 170, 120, 170, 120, 170]
    assert np.rad2deg(limits.position.upper) == pytest.approx(degrees)
    assert np.rad2deg(limits.velocity.upper) == pytest.approx([100, 110, 100, 130, 130, 180, 180])
    assert robot.available_acceleration is not None
    assert np.rad2deg(robot.available_acceleration) == pytest.approx([300] * 7)


def test_bending_the_lwrs_elbow_moves_its_hand_sideways() -> None:
    """q4 = 90 deg: the forearm lies level, 0.39 + 0.078 m out from the elbow at 0.7105 m."""
    X = _placement(load_robot("lwr"), np.array([0, 0, 0, pi / 2, 0, 0, 0]))
    assert np.hypot(X.translation[0], X.translation[1]) == pytest.approx(0.468)
    assert X.translation[2] == pytest.approx(0.7105)


def test_the_omnidirectional_base_moves_freely_in_the_plane() -> None:
    """Body velocities integrate on SE(2); there are no limits."""
    robot = load_robot("base")
    assert robot.task_rows == (0, 1, 5)
    v = np.array([0.3, -0.2, 0.7])
    q = pin.integrate(robot.model, robot.q0, v)
    expected = pin.exp6(pin.Motion(np.array([0.3, -0.2, 0, 0, 0, 0.7])))
    X = _placement(robot, q)
    assert X.homogeneous == pytest.approx(expected.homogeneous)
    seen = robot.limits.at(q)
    assert seen.to_lower is not None
    assert np.all(np.isinf(seen.to_lower))
    assert robot.limits.velocity is not None
    assert np.all(np.isinf(robot.limits.velocity.upper))


def test_a_single_joint_has_a_jacobian_of_one_column() -> None:
    """Pinocchio makes a vector of it."""
    robot = load_robot("planar1r")
    kinematics = Kinematics(robot)
    kinematics.update(np.array([0.5]))
    assert kinematics.jacobian(robot.frame_id) == pytest.approx(np.array([[0, 0.4, 0, 0, 0, 1]]).T)
    assert robot.limits.position is not None
    assert robot.limits.position.lower == pytest.approx([0.0])
    assert robot.limits.position.upper == pytest.approx([2 * pi])


def test_the_chain_of_a_frame_leaves_the_gripper_out() -> None:
    """Only joints that move the task frame count for its margins."""
    robot = load_robot("panda")
    assert list(robot.chain) == list(range(7))
    elbow = load_robot("panda", "panda_link4")
    assert list(elbow.chain) == [0, 1, 2, 3]
    kinova = load_robot("kinova")
    assert list(kinova.chain) == list(range(6))


def test_reach_is_measured_from_the_first_joint() -> None:
    """The stretched planar arm reaches as far as its links are long."""
    robot = load_robot("planar3r")
    assert robot.reach_of(_placement(robot, np.zeros(3))) == pytest.approx(0.9)
    panda = load_robot("panda")
    above = pin.SE3(np.eye(3), np.array([0.3, 0.4, 0.333]))
    assert panda.reach_of(above) == pytest.approx(0.5)
