"""Position and orientation errors where not all rows of a twist are asked for."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.robot import Robot


def in_task_axes(robot: Robot, rotation: Array, values: Array) -> Array:
    """Turn vectors (3,) or columns (3, n) in a frame's axes into the robot's task axes.

    Args:
        robot: the robot.
        rotation: of the frame, (3, 3).
        values: the vectors.
    """
    return values if robot.task_axes == "body" else rotation @ values


def orientation_error(robot: Robot, relative: Array, rotation: Array, asked: list[int]) -> Array:
    """Compute the rotation (3,) [rad] that brings a frame to what is asked of its orientation.

    With Q = R^T R_d the target's rotation seen from the frame: log3(Q) where all of it is asked
    for. Where one axis a is free, the smallest rotation after which a turn about a is left: the one
    that brings a to Q a (a in the frame), or R^T R_d's image of a world axis to that axis. Where a
    turn about one axis only is asked for, the turn about it that is left by the smallest rotation
    across it.

    Args:
        robot: the robot, whose task axes count.
        relative: Q, (3, 3).
        rotation: R, (3, 3).
        asked: the axes, 0 to 2, about which turns are asked for.

    Returns:
        In the robot's task axes.
    """
    # In the world's axes the rotation to be made is M = R Q R^T = R_d R^T.
    M = relative if robot.task_axes == "body" else rotation @ relative @ rotation.T
    if len(asked) == 1:
        quaternion = pin.Quaternion(M)
        x, y, z, w = quaternion.coeffs()
        along = (x, y, z)[asked[0]]
        half = np.arctan2(along, w)
        turn = np.zeros(3)
        turn[asked[0]] = 2 * (half - np.pi * np.round(half / np.pi))
        return turn
    if len(asked) == 2:
        axis = np.zeros(3)
        axis[[k for k in range(3) if k not in asked]] = 1.0
        # M = (a turn about the free axis, on its free side) times the rotation looked for.
        before, after = (axis, M @ axis) if robot.task_axes == "body" else (M.T @ axis, axis)
        across = np.cross(before, after)
        sine, cosine = float(np.linalg.norm(across)), float(before @ after)
        if sine == 0.0:
            across = np.zeros(3)
            across[asked[0]] = float(cosine < 0)
            return np.pi * across
        swing: Array = np.arctan2(sine, cosine) / sine * across
        return swing
    error: Array = pin.log3(M)
    return error
