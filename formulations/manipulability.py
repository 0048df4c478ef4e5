"""The gradient of the manipulability, from the Jacobian alone."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Kinematics, Robot, thin_svd

STEADY_JOINTS: Final = frozenset(
    {"JointModelFreeFlyer", "JointModelSpherical", "JointModelPlanar", "JointModelTranslation"}
)
"""Joints of several velocities whose axes stay as they are in the body that they move."""

SPATIAL: Final = (0, 1, 2, 3, 4, 5)
PLANAR: Final = (0, 1, 5)

_NEXT: Final = [1, 2, 0]
_AFTER: Final = [2, 0, 1]

ROUNDING: Final = 1e-9
"""Entries of a Jacobian up to this (m, rad) are zero."""


def manipulability_gradient(J: Array, before: Sequence[int] | None = None) -> Array:
    """Compute dw/dq of w = sqrt det(J J^T), (nv,), for a body Jacobian J (6, nv).

        dw/dq_k = w tr(J^+ dJ/dq_k),   dJ_j/dq_k = [J_j, J_k] for a joint k after joint j, else 0

    with [a, b] the Lie bracket of two body twists (linear; angular), columns in the order of the
    chain. With the columns (v; w) of J and (a; b) of (J^+)^T its trace is

        w_k . sum_j (a_j x v_j + b_j x w_j) + v_k . sum_j a_j x w_j

    Zero where w is zero. In tangent coordinates: that of a free-flyer at the root is zero,
    since moving the whole robot changes no body Jacobian. For a planar arm, J has three rows
    (x, y; yaw).

    Args:
        J: the Jacobian.
        before: for each column, how many there are of the joints before its own (see
            `columns_before`). Default: one joint per column, but for six leading ones that are a
            placement's action on twists, as only those of a free-flyer are at every configuration.

    Source: Yoshikawa (1985), Manipulability of robotic mechanisms; Haviland & Corke (2023),
    Manipulator differential kinematics, part 2.
    """
    m, n = J.shape
    if m > n:
        return np.zeros(n)
    U, singular, Vt = thin_svd(J)
    if singular[-1] <= np.finfo(float).eps * n * singular[0]:
        return np.zeros(n)
    inverse = (U / singular).dot(Vt)  # (J^+)^T
    if before is None:
        before = [*range(n)]
        if m == 6 and _is_free(J[:, :6]):
            before[:6] = [0] * 6
    v, w, a, b = (part.T for part in (*_parts(J), *_parts(inverse)))
    turning, moving = _crossed(a, v) + _crossed(b, w), _crossed(a, w)
    sums = np.zeros((2, n + 1, 3))  # over the columns before each
    np.cumsum([turning, moving], axis=1, out=sums[:, 1:])
    turning, moving = sums[:, [*before]]
    gradient = np.vecdot(w, turning) + np.vecdot(v, moving)
    result: Array = singular.prod() * gradient
    return result


@lru_cache(maxsize=32)
def columns_before(robot: Robot) -> tuple[int, ...]:
    """Count, for each velocity of a robot, those of the joints before its own."""
    before = [0] * robot.nv
    for joint in robot.model.joints:
        if joint.idx_v >= 0:
            before[joint.idx_v : joint.idx_v + joint.nv] = [joint.idx_v] * joint.nv
    return tuple(before)


@lru_cache(maxsize=32)
def tracks_whole_pose(robot: Robot) -> bool:
    """Say whether the rows of the robot's task are all that its frame can do: in space, in x-y."""
    if robot.task_rows != PLANAR:
        return robot.task_rows == SPATIAL
    kinematics = Kinematics(robot)
    away = np.random.default_rng(0).normal(size=robot.nv)
    kinematics.update(pin.integrate(robot.model, robot.q0, away))
    rest = np.delete(kinematics.jacobian(robot.frame_id), PLANAR, axis=0)
    return bool(np.abs(rest).max() <= ROUNDING)


@lru_cache(maxsize=32)
def joint_without_gradient(robot: Robot) -> str:
    """Name a joint that moves the frame and whose own axes move; empty where there is none."""
    model = robot.model
    for index in model.supports[model.frames[robot.frame_id].parentJoint]:
        joint = model.joints[index]
        if joint.nv != 1 and joint.shortname() not in STEADY_JOINTS:
            return str(model.names[index])
    return ""


def _is_free(block: Array) -> bool:
    """Say whether six columns are [R, B; 0, R], the action of a placement on twists."""
    R = block[:3, :3]
    steady = np.abs(block[3:, :3]).max() + np.abs(block[3:, 3:] - R).max()
    return bool(steady + np.abs(R.T @ R - np.eye(3)).max() <= ROUNDING)


def _parts(rows: Array) -> tuple[Array, Array]:
    """Split the six rows of twists, or the three of planar ones, into linear and angular ones."""
    if len(rows) == 6:
        return rows[:3], rows[3:]
    spatial = np.zeros((6, rows.shape[1]))
    spatial[[*PLANAR]] = rows
    return spatial[:3], spatial[3:]


def _crossed(a: Array, b: Array) -> Array:
    """Compute a x b of each of two arrays (n, 3); `np.cross` takes ten times as long."""
    return a[:, _NEXT] * b[:, _AFTER] - a[:, _AFTER] * b[:, _NEXT]
