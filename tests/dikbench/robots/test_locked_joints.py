"""Joints that are locked: where they stand, and what follows them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from makers.urdfs import SIX, Joint, write_arm

from dikbench.errors import DikbenchError
from dikbench.problem import Kinematics
from dikbench.robots.loading import load_robot


def test_locked_joints_do_not_move(tmp_path: Path) -> None:
    """The rest of the Jacobian is unchanged, and what follows a locked joint is locked."""
    whole = load_robot("panda")
    robot = load_robot("panda", lock=["panda_joint3"])
    kept = [0, 1, 3, 4, 5, 6]
    J = []
    for each in (whole, robot):
        kinematics = Kinematics(each)
        kinematics.update(each.q0)
        J.append(kinematics.jacobian(each.frame_id).copy())
    np.testing.assert_allclose(J[1], J[0][:, kept], atol=1e-14)
    assert robot.limits.position is not None
    assert whole.limits.position is not None
    np.testing.assert_array_equal(robot.limits.position.upper, whole.limits.position.upper[kept])
    assert robot.available_acceleration is not None
    assert len(robot.available_acceleration) == 6
    joints = [Joint(j.axis, mimic='joint="j2"' if n == 4 else "") for n, j in enumerate(SIX, 1)]
    path = write_arm(tmp_path, joints)
    assert load_robot(path, "tool", lock="j2=0.4 j1").nv == 3
    at = {"j2": 0.4, "j1": 0.1}
    placed = load_robot(path, "tool", lock=at, start=[0.1, 0.2, 0.3])
    free = load_robot(path, "tool", start=[0.1, 0.4, 0.1, 0.2, 0.3])
    poses = []
    for each in (placed, free):
        kinematics = Kinematics(each)
        kinematics.update(each.q0)
        poses.append(kinematics.placement(each.frame_id).homogeneous)
    np.testing.assert_allclose(poses[0], poses[1], atol=1e-12)


@pytest.mark.parametrize(
    ("lock", "message"),
    [
        ("j9", "unknown joint 'j9' of robot arm"),
        ("j1=9", "lock=j1=9 is outside the position limits, -3 to 3"),
        ("j1=x", "lock='j1=x' is not valid"),
        ("j1 j2 j3 j4 j5 j6", "all joints are locked"),
    ],
)
def test_a_lock_that_makes_no_sense(lock: str, message: str, tmp_path: Path) -> None:
    """One line each."""
    with pytest.raises(DikbenchError) as caught:
        load_robot(write_arm(tmp_path, SIX), "tool", lock=lock)
    assert message in str(caught.value)


def test_a_follower_is_locked_by_the_joint_that_it_follows(tmp_path: Path) -> None:
    """It has no position of its own; a folder is no robot, and `True` no limit."""
    path = write_arm(tmp_path, (*SIX, Joint(mimic='joint="j6"')))
    with pytest.raises(DikbenchError, match="joint 'j7' follows 'j6'; lock that one"):
        load_robot(path, "tool", lock="j7")
    with pytest.raises(DikbenchError, match="is a folder"):
        load_robot(str(tmp_path), "tool")
    with pytest.raises(DikbenchError, match="effort limit: expected numbers, got True"):
        load_robot(path, "tool").with_limits(effort=True)


@pytest.mark.parametrize("lock", ["j1=nan", "j1=inf", "j1 j1=0.5", {"j1": float("nan")}])
def test_positions_of_locked_joints_are_numbers_given_once(
    lock: str | dict[str, float], tmp_path: Path
) -> None:
    """Also of a joint without limits, in a text or in a mapping."""
    path = write_arm(tmp_path, (Joint(kind="continuous"), *SIX[1:]))
    with pytest.raises(DikbenchError, match="is not valid; valid: names of joints"):
        load_robot(path, "tool", lock=lock)
