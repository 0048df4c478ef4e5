"""Joints that are locked, in models that give a link and a joint one name."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from dikbench.robots.example_robot_data import data_file
from dikbench.robots.loading import load_robot
from dikbench.robots.reduced_model import reduced_model

FILES = {
    "a fixed joint and its link": "z1_description/urdf/z1.urdf",
    "a moving joint and another link": "so_arm_description/urdf/so100.urdf",
    "none": "ur_description/urdf/ur5_robot.urdf",
}


@pytest.mark.parametrize("which", FILES)
def test_any_joint_can_be_locked_and_names_and_links_stay(which: str) -> None:
    """At any configuration: every link is where it was, every other joint is called as it was."""
    model = pin.buildModelFromUrdf(data_file(FILES[which]))
    q = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq))
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    names = list(model.names)
    frames = [frame.name for frame in model.frames]
    for joint in range(1, model.njoints):
        reduced = reduced_model(model, [joint], q)
        assert list(reduced.names) == [*names[:joint], *names[joint + 1 :]]
        other = reduced.createData()
        gone = model.joints[joint].idx_q
        pin.framesForwardKinematics(reduced, other, np.delete(q, gone))
        for number, frame in enumerate(model.frames):
            if frame.type == pin.FrameType.BODY:
                there = reduced.getFrameId(frame.name, pin.FrameType.BODY)
                assert other.oMf[there].isApprox(data.oMf[number], 1e-12)
    assert [frame.name for frame in model.frames] == frames
    assert list(model.names) == names


def test_a_robot_with_such_a_joint_is_loaded() -> None:
    """As a selector does."""
    file = data_file(FILES["a fixed joint and its link"])
    robot = load_robot(file, "link06", lock={"joint6": 0.1})
    assert robot.nv == 6
    assert "joint6" not in list(robot.model.names)
