"""The bodies of a robot, which must not touch an obstacle or each other."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.captured_stderr import captured_stderr
from dikbench.robots.collision.enclosing_capsule import enclosing_capsule
from dikbench.robots.collision.obstacles import capsule
from dikbench.robots.robot import Robot

LINK_RADIUS_M: Final = 0.04
"""Radius of the links of a robot without collision geometry."""

SHORTEST_LINK_M: Final = 1e-3
"""A shorter link has no body of its own."""


def collision_bodies(robot: Robot) -> Any:
    """Build the bodies of a robot, a `pinocchio.GeometryModel` for its model, without pairs.

    Primitive shapes of its URDF's collision geometry are kept; a mesh is replaced by a capsule that
    contains all its vertices, so that distances are never larger than the mesh's. Without a URDF
    the bodies are capsules of radius 0.04 m along the links, from each joint to the next ones.

    Raises:
        DikbenchError: if a mesh is missing, or there is no geometry and no link.
    """
    bodies = _from_urdf(robot) if robot.urdf else _along_links(robot.model)
    if not len(bodies.geometryObjects):
        if robot.urdf:
            raise DikbenchError(f"robot {robot.name}: the URDF has no collision geometry")
        raise DikbenchError(f"robot {robot.name}: no collision geometry and no links are known")
    return bodies


def _from_urdf(robot: Robot) -> Any:
    full, fitted = _fitted(str(robot.urdf))
    bodies, frames = pin.GeometryModel(), robot.model.frames
    for body in fitted.geometryObjects:
        # The frame of its link, which is there whatever joints are locked.
        link = full.frames[body.parentFrame]
        index = robot.model.getFrameId(link.name, link.type)
        within = link.placement.actInv(body.placement)
        placement = frames[index].placement * within
        bodies.addGeometryObject(
            pin.GeometryObject(
                body.name, frames[index].parentJoint, index, placement, body.geometry
            )
        )
    return bodies


@lru_cache(maxsize=8)
def _fitted(urdf: str) -> tuple[Any, Any]:
    """Load a URDF, all joints moving, and fit capsules to its collision geometry."""
    # A package:// path starts at one of the folders above the file.
    folders = [str(folder) for folder in Path(urdf).resolve().parents]
    with captured_stderr() as complaints:
        try:
            model = pin.buildModelFromUrdf(urdf)
            found = pin.buildGeomFromUrdf(
                model, urdf, pin.GeometryType.COLLISION, package_dirs=folders
            )
        except (ValueError, RuntimeError) as error:
            reason = " ".join(f"{error} {complaints()}".split())
            raise DikbenchError(f"robot file {urdf}: collision geometry: {reason}") from None
    bodies = pin.GeometryModel()
    for body in found.geometryObjects:
        shape, placement = body.geometry, body.placement
        if hasattr(shape, "vertices"):
            vertices = np.asarray(shape.vertices()).reshape(-1, 3)  # scaled already
            shape, within = capsule(*enclosing_capsule(vertices))
            placement = placement * within
        bodies.addGeometryObject(
            pin.GeometryObject(body.name, body.parentJoint, body.parentFrame, placement, shape)
        )
    return model, bodies


def _along_links(model: Any) -> Any:
    bodies = pin.GeometryModel()
    for joint in range(1, model.njoints):
        for number, end in enumerate(_ends(model, joint)):
            shape, placement = capsule(np.zeros(3), end, LINK_RADIUS_M)
            name = f"{model.names[joint]}_{number}"
            bodies.addGeometryObject(pin.GeometryObject(name, joint, placement, shape))
    return bodies


def _ends(model: Any, joint: int) -> list[Array]:
    """Return where the links of a joint end: at the next joints, or else at its frames."""
    ends = [model.jointPlacements[child].translation for child in model.children[joint]]
    if not ends:
        ends = [
            frame.placement.translation
            for frame in model.frames
            if frame.parentJoint == joint and frame.type == pin.FrameType.OP_FRAME
        ]
    kept: list[Array] = []
    for end in ends:
        if all(np.linalg.norm(end - other) > SHORTEST_LINK_M for other in [np.zeros(3), *kept]):
            kept.append(end)
    return kept
