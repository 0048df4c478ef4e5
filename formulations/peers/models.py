"""The peers' models of a robot: a URDF of its Pinocchio model, and a check that both are one."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Interval, Kinematics, Robot

TOOL: Final = "tool"
"""The link that is the robot's task frame."""

SAME: Final = 1e-9
"""Largest difference of placements [m or 1] and Jacobians [m/rad or 1] that count as equal."""

UNLIMITED: Final = 1e9
"""Stands for no limit where a URDF needs a number [rad, m, rad/s or m/s]."""

At = Callable[[Array], tuple[Array, Array]]
"""From a configuration (nq,) to the task frame's placement (4, 4) and body Jacobian (6, nv)."""


def has_plain_joints(robot: Robot) -> bool:
    """Say whether every joint turns or slides by one coordinate of its own."""
    return bool(robot.model.njoints - 1 == robot.nv and all(j.nv == 1 for j in _joints(robot)))


def coordinates(robot: Robot, q: Array) -> Array:
    """Return an angle or a distance for each joint, (nv,), of q (nq,) with (cos, sin) in it."""
    if robot.nq == robot.nv:
        return q
    return np.array(
        [
            q[j.idx_q] if j.nq == 1 else np.arctan2(q[j.idx_q + 1], q[j.idx_q])
            for j in _joints(robot)
        ]
    )


def position_limits(robot: Robot) -> Interval:
    """Return the position limits of the model, whatever is in force, (nv,) each [rad or m]."""
    lower, upper = np.full(robot.nv, -np.inf), np.full(robot.nv, np.inf)
    for joint in _joints(robot):
        if joint.nq == 1:
            lower[joint.idx_v] = robot.model.lowerPositionLimit[joint.idx_q]
            upper[joint.idx_v] = robot.model.upperPositionLimit[joint.idx_q]
    return Interval(
        np.where(lower < -UNLIMITED, -np.inf, lower), np.where(upper > UNLIMITED, np.inf, upper)
    )


def velocity_limits(robot: Robot) -> Array:
    """Return the velocity limits of the model, whatever is in force, (nv,) [rad/s or m/s]."""
    known = np.array(robot.model.velocityLimit)
    return np.where((known == 0) | (known > UNLIMITED), np.inf, known)


def urdf_of(robot: Robot, position: Interval) -> str:
    """Write a URDF of the moving joints and the task frame, without shapes, of any masses.

    Joints have their names, in the model's order; the root is the world.

    Args:
        robot: the robot, whose joints are plain.
        position: the position limits to write.
    """
    model, document = robot.model, ET.Element("robot", name=robot.model.name or "robot")
    data, neutral = model.createData(), pin.neutral(model)
    velocity = np.minimum(velocity_limits(robot), UNLIMITED)
    ET.SubElement(document, "link", name="world")
    for index, joint in enumerate(_joints(robot), start=1):
        k = joint.idx_v
        axis = pin.computeJointJacobian(model, data, neutral, index).reshape(6, -1)[:, k]
        turns = bool(np.any(axis[3:]))
        limited = not turns or np.isfinite([position.lower[k], position.upper[k]]).any()
        kind = ("revolute" if limited else "continuous") if turns else "prismatic"
        placed = model.jointPlacements[index]
        element = _joined(document, model.names[index], kind, model.parents[index], placed)
        _link(document, f"body{index}")
        ET.SubElement(element, "child", link=f"body{index}")
        ET.SubElement(element, "axis", xyz=_numbers(axis[3:] if turns else axis[:3]))
        bounds = {"effort": "0", "velocity": repr(float(velocity[k]))}
        if limited:
            bounds["lower"] = repr(float(max(position.lower[k], -UNLIMITED)))
            bounds["upper"] = repr(float(min(position.upper[k], UNLIMITED)))
        ET.SubElement(element, "limit", bounds)
    frame = model.frames[robot.frame_id]
    element = _joined(document, f"{TOOL}_fixed", "fixed", frame.parentJoint, frame.placement)
    _link(document, TOOL)
    ET.SubElement(element, "child", link=TOOL)
    # Of MuJoCo: links without a moving joint stay.
    ET.SubElement(ET.SubElement(document, "mujoco"), "compiler", fusestatic="false")
    return ET.tostring(document, encoding="unicode")


def check_same(robot: Robot, peer: str, at: At) -> None:
    """Check that a peer's model places the task frame where ours does, and has our Jacobian.

    Args:
        robot: the robot.
        peer: the peer's name.
        at: what the peer computes.

    Raises:
        DikbenchError: if one of them differs by more than `SAME` at one of three configurations.
    """
    kinematics, random = Kinematics(robot), np.random.default_rng(0)
    for _ in range(3):
        q = robot.inside(pin.integrate(robot.model, robot.q0, random.uniform(-1, 1, robot.nv)))
        kinematics.update(q)
        placement, J = at(q)
        ours = kinematics.placement(robot.frame_id).homogeneous
        apart = (placement - ours).ravel(), (J - kinematics.jacobian(robot.frame_id)).ravel()
        off = np.abs(np.concatenate(apart)).max()
        if not off <= SAME:
            raise DikbenchError(
                f"robot {robot.name}: the model of {peer} differs by {off:.1e} in the placement or "
                f"the Jacobian of {robot.frame}; valid: at most {SAME:g}"
            )


def in_body_axes(R: Array, J: Array) -> Array:
    """Turn a Jacobian (linear; angular) (6, nv) from the world's axes into those of a frame."""
    return np.vstack([R.T @ J[:3], R.T @ J[3:]])


def _joints(robot: Robot) -> list[Any]:
    return list(robot.model.joints)[1:]


def _link(document: ET.Element, name: str) -> None:
    inertial = ET.SubElement(ET.SubElement(document, "link", name=name), "inertial")
    ET.SubElement(inertial, "mass", value="1")
    moments = {"ixx": "1", "iyy": "1", "izz": "1", "ixy": "0", "ixz": "0", "iyz": "0"}
    ET.SubElement(inertial, "inertia", moments)


def _joined(document: ET.Element, name: str, kind: str, parent: int, placed: Any) -> ET.Element:
    element = ET.SubElement(document, "joint", name=name, type=kind)
    ET.SubElement(element, "parent", link=f"body{parent}" if parent else "world")
    rpy = pin.rpy.matrixToRpy(placed.rotation)
    ET.SubElement(element, "origin", xyz=_numbers(placed.translation), rpy=_numbers(rpy))
    return element


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
