"""A planar arm of any number of links, built in code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin


def planar_arm(
    lengths: tuple[float, ...],
    *,
    velocity_limits: tuple[float, ...],
    position_limit: tuple[float, float] = (-2.8, 2.8),
) -> Any:
    """Build a chain of revolute joints about z, with links along x.

    Args:
        lengths: length of each link [m].
        velocity_limits: largest |v| of each joint [rad/s].
        position_limit: lower and upper limit of every joint [rad].

    Returns:
        A Pinocchio model with the frames `link1`, ... at the end of each link and `tip` at the end
        of the last one. Every link has 1 kg, spread evenly along it.
    """
    model = pin.Model()
    model.name = f"planar{len(lengths)}r"
    parent, placement = 0, pin.SE3.Identity()
    lower, upper = position_limit
    for number, (length, speed) in enumerate(zip(lengths, velocity_limits, strict=True), start=1):
        parent = add_hinge(model, parent, placement, f"joint{number}", (lower, upper), speed)
        model.appendBodyToJoint(
            parent,
            pin.Inertia.FromCylinder(1.0, 0.02, length),
            pin.SE3(pin.utils.rotate("y", np.pi / 2), np.array([length / 2, 0.0, 0.0])),
        )
        placement = pin.SE3(np.eye(3), np.array([length, 0.0, 0.0]))
        model.addFrame(pin.Frame(f"link{number}", parent, 0, placement, pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("tip", parent, 0, placement, pin.FrameType.OP_FRAME))
    return model


def add_hinge(
    model: Any, parent: int, placement: Any, name: str, limits: tuple[float, float], speed: float
) -> int:
    """Add a revolute joint about z with position limits [rad] and a largest speed [rad/s].

    Returns:
        Pinocchio's index of the joint; its effort limit is 100 N m.
    """
    effort, velocity, lower, upper = (np.array([x]) for x in (100.0, speed, *limits))
    joint = pin.JointModelRZ()
    return int(model.addJoint(parent, joint, placement, name, effort, velocity, lower, upper))
