"""A robot that carries something."""

from __future__ import annotations

from dataclasses import replace

import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.robots.robot import Robot


def with_payload(robot: Robot, mass: float, radius: float = 0.05) -> Robot:
    """Return the same robot with a solid ball in its hand, centred on the task frame.

    The ball's inertia is added to the body that carries the frame; the kinematics do not change.

    Args:
        robot: the robot; it is not changed.
        mass: mass of the ball [kg].
        radius: its radius [m].

    Raises:
        DikbenchError: if mass or radius is not positive and finite.
    """
    for name, value in (("mass", mass), ("radius", radius)):
        if not 0 < value < float("inf"):
            raise DikbenchError(f"payload: {name}={value} must be positive and finite")
    model = robot.model.copy()
    frame = model.frames[robot.frame_id]
    ball = pin.Inertia.FromSphere(mass, radius)
    model.appendBodyToJoint(frame.parentJoint, ball, frame.placement)
    return replace(robot, model=model, payload_radius=radius)
