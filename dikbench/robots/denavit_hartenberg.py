"""An arm built from its table of Denavit-Hartenberg parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.robots.planar_arm import add_hinge


def denavit_hartenberg_arm(
    name: str,
    table: tuple[tuple[float, float, float], ...],
    *,
    position_limits: tuple[float, ...],
    velocity_limits: tuple[float, ...],
) -> Any:
    """Build a chain of revolute joints from rows (a, alpha, d) of the standard convention.

        A_i(q) = Rot_z(q) Trans_z(d_i) Trans_x(a_i) Rot_x(alpha_i)

    Args:
        name: name of the model.
        table: a [m], alpha [rad], d [m] of each joint.
        position_limits: largest |q| of each joint [rad].
        velocity_limits: largest |v| of each joint [rad/s].

    Returns:
        A Pinocchio model with the frame `tool` at the end of the last row. Every link is a ball
        of 1 kg at its end, since the table has no inertias.
    """
    model = pin.Model()
    model.name = name
    parent, placement = 0, pin.SE3.Identity()
    for number, (a, alpha, d) in enumerate(table, start=1):
        position, speed = position_limits[number - 1], velocity_limits[number - 1]
        limits = -position, position
        parent = add_hinge(model, parent, placement, f"joint{number}", limits, speed)
        placement = pin.SE3(_rotation_about_x(alpha), np.array([a, 0.0, d]))
        model.appendBodyToJoint(parent, pin.Inertia.FromSphere(1.0, 0.05), placement)
    model.addFrame(pin.Frame("tool", parent, 0, placement, pin.FrameType.OP_FRAME))
    return model


def _rotation_about_x(angle: float) -> Array:
    """Build a rotation (3, 3) with exact zeros and ones at quarter turns."""
    c, s = np.round(np.cos(angle), 15), np.round(np.sin(angle), 15)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
