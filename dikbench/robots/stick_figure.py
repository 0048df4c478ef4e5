"""A robot as a stick figure: a point per joint."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.robot import Robot


def stick(robot: Robot, q: Array) -> Array:
    """Origins of the joints that carry the task frame, from the base on, and its own, (k, 3)."""
    model, data = robot.model, robot.model.createData()
    pin.forwardKinematics(model, data, q)
    tip = pin.updateFramePlacement(model, data, robot.frame_id).translation
    joints = model.supports[model.frames[robot.frame_id].parentJoint]
    return np.array([*(data.oMi[joint].translation for joint in joints), tip])
