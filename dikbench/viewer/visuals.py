"""The visual geometry of a robot: its meshes, or capsules from joint to joint."""

from __future__ import annotations

from typing import Any, Final

import coal
import numpy as np
import pinocchio as pin

from dikbench.robots.collision.obstacles import capsule
from dikbench.robots.robot import Robot

GREY_RGBA: Final = (0.62, 0.66, 0.71, 1.0)

CAPSULE_RADIUS_SHARE: Final = 0.02
"""Radius of a capsule, as a share of the arm's length."""

DISC_RADIUS_M, DISC_HEIGHT_M = 0.2, 0.1
"""Size of what stands for a robot without links, such as a mobile base."""


def bodies(robot: Robot) -> Any:
    """Return the robot's own geometry, else capsules (`pinocchio.GeometryModel`)."""
    if robot.visuals is not None:
        try:
            visuals = robot.visuals()
        except ValueError:  # a URDF without its meshes
            return capsules(robot)
        for body in visuals.geometryObjects:
            if body.meshPath.lower().endswith(".dae"):
                # Browsers lose parts with several materials: send triangles, which are scaled.
                body.meshPath, body.meshScale = "", np.ones(3)
                body.meshColor = np.array(GREY_RGBA)
        return visuals
    return capsules(robot)


def capsules(robot: Robot) -> Any:
    """Build capsules from the base through the joints to the task frame.

    A robot all of whose joints are in one place is a disc.
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
        link = pin.GeometryObject(f"link{number}", joint, placement, shape)
        link.meshColor = np.array(GREY_RGBA)
        geometry.addGeometryObject(link)
    if not geometry.ngeoms:
        shape = coal.Cylinder(DISC_RADIUS_M, DISC_HEIGHT_M)
        disc = pin.GeometryObject("disc", tip.parentJoint, pin.SE3.Identity(), shape)
        disc.meshColor = np.array(GREY_RGBA)
        geometry.addGeometryObject(disc)
    return geometry
