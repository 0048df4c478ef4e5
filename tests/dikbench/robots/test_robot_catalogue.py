"""The catalogue's robots: starts, limits, singular postures and the planar arm in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot


def _sigma_min(robot: Robot, q: Array) -> float:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return smallest_singular_value(kinematics.jacobian(robot.frame_id)[list(robot.task_rows)])


# --- the catalogue


@pytest.mark.parametrize("name", ROBOTS)
def test_starts_are_inside_limits_and_away_from_singularities(name: str) -> None:
    """Every robot's safe start is half a radian from any limit, with sigma_min above 0.03.

    A quarter for the humanoid, whose waist and head have no more.
    """
    robot = load_robot(name)
    seen = robot.limits.at(robot.q0)
    assert seen.to_lower is not None
    assert seen.to_upper is not None
    room = 0.25 if name == "talos-humanoid" else 0.5
    assert min(seen.to_lower.min(), seen.to_upper.min()) > room
    assert _sigma_min(robot, robot.q0) > 0.03


@pytest.mark.parametrize("name", sorted(set(ROBOTS) - {"base", "talos-humanoid"}))
def test_velocity_limits_are_symmetric_and_positive(name: str) -> None:
    """Pinocchio's own lower velocity limits carry the wrong sign: they are not read."""
    velocity = load_robot(name).limits.velocity
    assert velocity is not None
    assert np.all(velocity.upper > 0)
    assert np.all(np.isfinite(velocity.upper))
    assert np.array_equal(velocity.lower, -velocity.upper)


@pytest.mark.parametrize("name", ROBOTS)
def test_only_position_and_velocity_limits_are_in_force(name: str) -> None:
    """Acceleration and effort limits are known but switched on by a scenario or a user."""
    limits = load_robot(name).limits
    assert limits.position is not None
    assert limits.velocity is not None
    assert limits.acceleration is None
    assert limits.effort is None


@pytest.mark.parametrize("name", ROBOTS)
def test_acceleration_limits_are_a_table_with_its_source(name: str) -> None:
    """One positive number per joint, the source named, and usable as it is; or none, and why."""
    entry, robot = ROBOTS[name], load_robot(name)
    assert entry.acceleration_source
    if robot.available_acceleration is None:
        assert entry.acceleration is None
        return
    assert robot.available_acceleration.shape == (robot.nv,)
    assert np.all(robot.available_acceleration > 0)
    assert entry.acceleration_source
    assert entry.acceleration is not None
    in_force = robot.with_limits(acceleration=robot.available_acceleration).limits.acceleration
    assert in_force is not None
    assert np.array_equal(in_force.upper, entry.acceleration)
    assert np.array_equal(in_force.lower, np.negative(entry.acceleration))


def test_the_panda_has_seven_joints_and_the_manufacturers_limits() -> None:
    """Fingers locked, frame panda_hand_tcp, 2.175 and 2.61 rad/s, data-sheet accelerations."""
    panda = load_robot("panda")
    assert (panda.nq, panda.nv, panda.frame) == (7, 7, "panda_hand_tcp")
    assert panda.limits.velocity is not None
    assert panda.limits.velocity.upper == pytest.approx([2.175] * 4 + [2.61] * 3)
    assert panda.available_acceleration == pytest.approx([15, 7.5, 10, 12.5, 15, 20, 20])
    assert panda.limits.position is not None
    assert panda.limits.position.upper[3] < 0  # the elbow cannot be stretched


@pytest.mark.parametrize(
    ("name", "q"),
    [
        ("ur5", (0.3, -1.2, 1.4, -1.0, 0.0, 0.2)),  # wrist
        ("ur5", (0.3, 0.76504, 1.4, -1.0, 0.9, 0.2)),  # shoulder
        ("ur5", (0.3, -1.2, 0.0, -1.0, 0.9, 0.2)),  # elbow
        ("panda", (0.0, 0.3, 0.0, -0.46700, 0.0, 1.6, 0.785)),
        ("xarm7", (0.0,) * 7),
    ],
)
def test_the_known_singular_postures_are_singular(name: str, q: tuple[float, ...]) -> None:
    """Science 4.2, 4.3: they are so on our models in our task frames."""
    assert _sigma_min(load_robot(name), np.array(q)) < 1e-4


@settings(deadline=None)
@given(q=arrays(float, 3, elements=st.floats(-2.8, 2.8)))
def test_planar_arm_follows_the_closed_form(q: Array) -> None:
    """The tip is at sum l_i (cos, sin)(q_1 + ... + q_i), turned by the sum of the angles."""
    robot = load_robot("planar3r")
    kinematics = Kinematics(robot)
    kinematics.update(q)
    X = kinematics.placement(robot.frame_id)
    angles, lengths = np.cumsum(q), np.array([0.4, 0.3, 0.2])
    assert X.translation == pytest.approx(
        [lengths @ np.cos(angles), lengths @ np.sin(angles), 0.0], abs=1e-12
    )
    c, s = np.cos(angles[-1]), np.sin(angles[-1])
    assert np.allclose(X.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-12)


@settings(deadline=None)
@given(q=arrays(float, 3, elements=st.floats(-2.8, 2.8)))
def test_planar_arm_cannot_move_the_rows_that_its_tasks_leave_out(q: Array) -> None:
    """Rows z, roll and pitch of its body Jacobian are zero; the others are the closed form's."""
    robot = load_robot("planar3r")
    kinematics = Kinematics(robot)
    kinematics.update(q)
    J = kinematics.jacobian(robot.frame_id)
    assert np.abs(J[[2, 3, 4]]).max() < 1e-12
    # Column i: the tip seen from joint i, turned by 90 degrees, in the axes of the tip.
    angles, lengths = np.cumsum(q), np.array([0.4, 0.3, 0.2])
    seen = angles - angles[-1]
    for i in range(3):
        arm = lengths[i:] @ np.column_stack([np.cos(seen[i:]), np.sin(seen[i:])])
        assert J[[0, 1, 5], i] == pytest.approx([-arm[1], arm[0], 1.0], abs=1e-12)
