"""The gradient of the manipulability, from the Jacobian alone."""

from __future__ import annotations

import numpy as np

from dikbench.problem import Array, thin_svd


def manipulability_gradient(J: Array) -> Array:
    """Compute dw/dq of w = sqrt det(J J^T), (nv,), for a body Jacobian J (6, nv).

        dw/dq_k = w tr(J^+ dJ/dq_k),   dJ_j/dq_k = [J_j, J_k] for k > j, else 0

    with [a, b] the Lie bracket of two body twists (linear; angular), columns in the order of the
    chain, one joint each; zero where w is zero. For a planar arm, J has three rows (x, y; yaw).

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
    gradient = np.zeros(n)
    for k in range(1, n):
        v, w = linear[:, k : k + 1], angular[:, k : k + 1]
        turned = np.cross(angular[:, :k], w, axis=0)
        moved = np.cross(linear[:, :k], w, axis=0) + np.cross(angular[:, :k], v, axis=0)
        change = np.vstack([moved, turned]) if m == 6 else np.vstack([moved[:2], turned[2:]])
        gradient[k] = np.einsum("ij,ij->", inverse[:, :k], change)
    result: Array = singular.prod() * gradient
    return result


def _in_space(rows: Array, first: int) -> Array:
    """Write the rows of a planar twist as the three of a spatial one."""
    spatial = np.zeros((3, rows.shape[1]))
    spatial[first : first + len(rows)] = rows
    return spatial
