"""The gradient of the manipulability, from the Jacobian alone."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, Kinematics, Robot, thin_svd, volume

STEADY_JOINTS: Final = frozenset(
    {"JointModelFreeFlyer", "JointModelSpherical", "JointModelPlanar", "JointModelTranslation"}
)
"""Joints of several velocities whose axes stay as they are in the body that they move."""

SPATIAL: Final = (0, 1, 2, 3, 4, 5)
PLANAR: Final = (0, 1, 5)

ROUNDING: Final = 1e-9
"""Entries of a Jacobian up to this (m, rad) are zero."""


def manipulability_gradient(J: Array, before: Sequence[int] | None = None) -> Array:
    """Compute dw/dq of w = sqrt det(J J^T), (nv,), for a body Jacobian J (6, nv).

        dw/dq_k = w tr(J^+ dJ/dq_k),   dJ_j/dq_k = [J_j, J_k] for a joint k after joint j, else 0

    with [a, b] the Lie bracket of two body twists (linear; angular), columns in the order of the
    chain; zero where w is zero. In tangent coordinates: that of a free-flyer at the root is zero,
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
    linear, angular = (J[:3], J[3:]) if m == 6 else (_in_space(J[:2], 0), _in_space(J[2:], 2))
    if before is None:
        before = [*range(n)]
        if m == 6 and _is_free(J[:, :6]):
            before[:6] = [0] * 6
    gradient = np.zeros(n)
    for k, j in enumerate(before):
        if j == 0:
            continue
        v, w = linear[:, k : k + 1], angular[:, k : k + 1]
        turned = np.cross(angular[:, :j], w, axis=0)
        moved = np.cross(linear[:, :j], w, axis=0) + np.cross(angular[:, :j], v, axis=0)
        change = np.vstack([moved, turned]) if m == 6 else np.vstack([moved[:2], turned[2:]])
        gradient[k] = np.einsum("ij,ij->", inverse[:, :j], change)
    result: Array = singular.prod() * gradient
    return result


def manipulability_gradients(J: Array, before: Sequence[int]) -> Array:
    """Compute `manipulability_gradient` of many Jacobians at once, (N, nv).

        w_k . sum_(j<k) (a_j x v_j + b_j x w_j) + v_k . sum_(j<k) a_j x w_j

    times the manipulability, with (v; w)_k the columns of J and (a; b)_j those of (J^+)^T.

    Args:
        J: (N, 6, nv), or (N, 3, nv) of a planar arm.
        before: see there.
    """
    size = volume(J)
    gram = J @ J.transpose(0, 2, 1)
    regular = size > np.finfo(float).eps * np.trace(gram, axis1=1, axis2=2) ** (J.shape[1] / 2)
    inverse = np.zeros_like(J)
    inverse[regular] = np.linalg.solve(gram[regular], J[regular])
    (v, w), (a, b) = (_columns(part) for part in (J, inverse))
    turning, moving = np.cross(a, v) + np.cross(b, w), np.cross(a, w)
    sums = [np.cumsum(part, axis=1) for part in (turning, moving)]
    first = np.zeros((len(J), 1, 3))
    turning, moving = (np.concatenate([first, part], axis=1)[:, [*before]] for part in sums)
    gradients: Array = np.vecdot(w, turning) + np.vecdot(v, moving)
    return np.where(regular, size, 0.0)[:, None] * gradients


def _columns(J: Array) -> tuple[Array, Array]:
    """Split Jacobians into the linear and angular parts of their columns, (N, nv, 3) each."""
    if J.shape[1] == 3:
        spatial = np.zeros((len(J), 6, J.shape[2]))
        spatial[:, PLANAR] = J
        J = spatial
    columns = np.ascontiguousarray(J.transpose(0, 2, 1))
    return columns[:, :, :3], columns[:, :, 3:]


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


def _in_space(rows: Array, first: int) -> Array:
    """Write the rows of a planar twist as the three of a spatial one."""
    spatial = np.zeros((3, rows.shape[1]))
    spatial[first : first + len(rows)] = rows
    return spatial
