"""How the joints of a robot move the nodes of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.robot import Robot

ROBOT_NODE: Final = "/robot"
"""Node of the robot's base; it stands in the world's frame."""

POSE_COLUMNS: Final = 7
"""Columns of a free joint: x, y, z [m] and the quaternion w, x, y, z."""

Kind = Literal["turn", "slide", "free"]


@dataclass(frozen=True)
class MovingJoint:
    """One joint as a node of a scene, whose pose in its parent node follows from coordinates c.

        turn:   orientation  quaternion(axis, c) wxyz  =  cos(c/2) wxyz + sin(c/2) turned
        slide:  position     position + c axis
        free:   position     c[0:3],   orientation  c[3:7]

    Attributes:
        node: name of its node; below it are those of the joints that it carries.
        kind: how it moves: it turns (revolute, continuous), slides (prismatic), or has any other
            motion (planar, spherical, free-flyer, helical, ...).
        column: the first of its columns in `joint_coordinates`; a free joint has 7, others one.
        axis: unit vector in the frame of the parent node, (3,); zero for a free joint.
        wxyz, position: pose in the parent node where c = 0.
        turned: the product of the quaternions (0, axis) and wxyz, (4,).
    """

    node: str
    kind: Kind
    column: int
    axis: tuple[float, ...]
    wxyz: tuple[float, ...]
    position: tuple[float, ...]
    turned: tuple[float, ...]

    def pose(self, row: Array) -> tuple[Array, Array]:
        """Compute position (3,) [m] and orientation w, x, y, z in the parent node.

        Args:
            row: coordinates of all joints, (columns,).
        """
        position, turn, c = np.array(self.position), np.array(self.wxyz), row[self.column]
        if self.kind == "free":
            return row[self.column : self.column + 3], row[self.column + 3 : self.column + 7]
        if self.kind == "slide":
            return position + c * np.array(self.axis), turn
        return position, np.cos(c / 2) * turn + np.sin(c / 2) * np.array(self.turned)


def body_node(node: str) -> str:
    """Return the name of the node of the mesh at a joint's node, or at the robot's."""
    return f"{node}/body"


def joint_nodes(model: Any, robot_node: str = ROBOT_NODE) -> list[str]:
    """Name the nodes of the joints of a Pinocchio model by their index, the universe first."""
    nodes = [robot_node]
    for joint in range(1, model.njoints):
        nodes.append(f"{nodes[model.parents[joint]]}/{joint}")
    return nodes


def moving_joints(robot: Robot, robot_node: str = ROBOT_NODE) -> list[MovingJoint]:
    """Describe the joints of a robot, in Pinocchio's order without the universe."""
    model, found, column = robot.model, [], 0
    nodes, motions = joint_nodes(model, robot_node), _motions(model)
    for number in range(1, model.njoints):
        placement = model.jointPlacements[number]
        kind, own_axis = motions[number]
        axis = placement.rotation @ own_axis
        turned = pin.Quaternion(0.0, *axis) * pin.Quaternion(placement.rotation)
        found.append(
            MovingJoint(
                nodes[number],
                kind,
                column,
                tuple(axis.tolist()),
                wxyz(placement.rotation),
                tuple(placement.translation.tolist()),
                tuple(turned.coeffs()[[3, 0, 1, 2]].tolist()),
            )
        )
        column += POSE_COLUMNS if kind == "free" else 1
    return found


def joint_coordinates(robot: Robot, q: Array) -> Array:
    """Compute the coordinates of all joints of configurations (n, nq), (n, columns).

    Angles [rad] go on beyond pi, so that what is between two rows is between their values. See
    `MovingJoint` for the columns.
    """
    model, columns, motions = robot.model, [], _motions(robot.model)
    relative: dict[int, list[Any]] = {}
    for number in range(1, model.njoints):
        joint, (kind, axis) = model.joints[number], motions[number]
        own = slice(joint.idx_q, joint.idx_q + joint.nq)
        if kind != "free" and joint.nv == 1 and joint.nq == 1:
            columns.append(q[:, own])
        elif kind == "turn" and joint.nv == 1:
            columns.append(np.unwrap(np.arctan2(q[:, own][:, 1], q[:, own][:, 0]))[:, None])
        else:
            relative = relative or _relative(model, q)
            placement = model.jointPlacements[number]
            columns.append(_coordinates(kind, axis, placement, relative[number]))
    return np.hstack([np.empty((len(q), 0)), *columns])


def wxyz(rotation: Array) -> tuple[float, ...]:
    """Convert a rotation (3, 3) to a quaternion, its scalar first."""
    x, y, z, w = pin.Quaternion(rotation).coeffs().tolist()
    return w, x, y, z


def _motions(model: Any) -> list[tuple[Kind, Array]]:
    """Read off the motion subspace of each joint whether it turns or slides, and its axis (3,)."""
    data, found = model.createData(), list[tuple[Kind, Array]]()
    pin.forwardKinematics(model, data, pin.neutral(model), np.zeros(model.nv))
    for joint in data.joints:
        subspace, nothing = np.asarray(joint.S), np.zeros(3)
        found.append(("free", nothing))
        if subspace.size == 6:
            linear, angular = subspace.reshape(6)[:3], subspace.reshape(6)[3:]
            if not linear.any() and angular.any():
                found[-1] = "turn", angular / np.linalg.norm(angular)
            elif not angular.any() and linear.any():
                found[-1] = "slide", linear / np.linalg.norm(linear)
    return found


def _relative(model: Any, q: Array) -> dict[int, list[Any]]:
    """Placements of the joints in their parents (`pinocchio.SE3`) at configurations (n, nq)."""
    data = model.createData()
    found: dict[int, list[Any]] = {}
    for configuration in q:
        pin.forwardKinematics(model, data, configuration)
        for number in range(1, model.njoints):
            found.setdefault(number, []).append(data.liMi[number].copy())
    return found


def _coordinates(kind: Kind, axis: Array, placement: Any, relative: list[Any]) -> Array:
    """Compute the coordinates of one joint from its placements in its parent, (n, columns)."""
    if kind == "free":
        poses = [[*X.translation, *wxyz(X.rotation)] for X in relative]
        return _one_sided(np.array(poses))
    motions = [placement.actInv(X) for X in relative]
    if kind == "slide":
        return np.array([[axis @ M.translation] for M in motions])
    quaternions = [wxyz(M.rotation) for M in motions]
    halves = [np.arctan2(axis @ np.array(xyz), w) for w, *xyz in quaternions]
    return 2 * np.unwrap(halves, period=np.pi)[:, None]


def _one_sided(poses: Array) -> Array:
    """Choose the sign of each quaternion of poses (n, 7) that is nearer to the one before."""
    quaternions = poses[:, 3:]
    turned = np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0
    signs = np.cumprod(np.where(np.concatenate([[False], turned]), -1.0, 1.0))
    return np.hstack([poses[:, :3], signs[:, None] * quaternions])
