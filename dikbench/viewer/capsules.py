"""What is drawn of a robot without meshes: capsules from joint to joint."""

from __future__ import annotations

from typing import Any, Final

import coal
import numpy as np
import pinocchio as pin

from dikbench.robots.collision.obstacles import capsule
from dikbench.robots.robot import Robot

CAPSULE_RADIUS_SHARE: Final = 0.02
"""Radius of a capsule, as a share of the arm's length."""

DISC_RADIUS_M, DISC_HEIGHT_M = 0.1, 0.04
"""Size of what stands for a robot without links, such as a mobile base."""


def capsules(robot: Robot) -> Any:
    """Build capsules from the base through the joints to the task frame.

    A robot all of whose joints are in one place is a disc below them.
    """
    model, geometry = robot.model, pin.GeometryModel()
    tip = model.frames[robot.frame_id]
    ends = [
        (parent, model.jointPlacements[joint].translation)
        for joint, parent in enumerate(model.parents)
        if joint
    ]
    ends.append((tip.parentJoint, tip.placement.translation))
    lengths = [float(np.linalg.norm(end)) for _, end in ends]
    radius = CAPSULE_RADIUS_SHARE * sum(lengths)
    for number, ((joint, end), length) in enumerate(zip(ends, lengths, strict=True)):
        if length == 0:
            continue
        shape, placement = capsule(np.zeros(3), end, radius)
        geometry.addGeometryObject(pin.GeometryObject(f"link{number}", joint, placement, shape))
    if not geometry.ngeoms:
        shape = coal.Cylinder(DISC_RADIUS_M, DISC_HEIGHT_M)
        below = pin.SE3(np.eye(3), np.array([0.0, 0.0, -DISC_HEIGHT_M / 2]))
        disc = pin.GeometryObject("disc", tip.parentJoint, below, shape)
        geometry.addGeometryObject(disc)
    return geometry
