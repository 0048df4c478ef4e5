"""A proof that no posture of an arm brings its task frame to a placement.

About each joint's axis, a point of the first axis has a height z, a distance rho from the axis and
a distance r from the joint's origin. Bounds on them follow along the chain from the base on, by the
triangle inequality and its likes, whatever the joints' angles. From the other end, the placement of
the task frame fixes that of the last joint, and the angles of the last joints, in cells that are
halved until each is excluded, those of the joints before. Where no cell is left, there is no
posture.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.robots.robot import Robot

ALLOWED_OUTSIDE: Final = 1e-3
"""A joint may be so far outside its position limits [rad] (see `dikbench.metrics.outcome`)."""

ROUNDING_M: Final = 1e-9
"""Added to each bound."""

PARALLEL: Final = 1e-9
"""Axes with a smaller sine of the angle between them are parallel."""

ON_AXIS_M: Final = 1e-6
"""A point that is nearer to an axis is on it, up to twice its distance."""

ARC_SAMPLES: Final = 10000
"""Angles of a joint at which a point that moves with it alone is looked at."""

CELLS_MOST: Final = 20000
"""Cells of joint angles after which there is no proof."""

CELL_LEAST_RAD: Final = 1e-3
"""A cell whose half width is below this is not halved: there is no proof."""

LAST_JOINTS: Final = 3
"""Number of the last joints whose angles are divided into cells."""


class _Joint(NamedTuple):
    """A revolute joint of the chain: its placement before it turns, its axis, and its range."""

    placement: Any
    axis: Array
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class _Where:
    """Where the base point is about a joint's axis, in pairs of lower and upper bounds [m].

    Attributes:
        rho: distance from the axis.
        z: height along the axis.
        r: distance from the joint's origin.
        point: its position in the joint's frame at the angle 0, where it is known, (3,).
    """

    rho: tuple[float, float]
    z: tuple[float, float]
    r: tuple[float, float]
    point: Array | None


def is_out_of_reach(
    robot: Robot,
    target: Any,
    tolerance: float,
    *,
    whole_pose: bool,
    length: float = CHARACTERISTIC_LENGTH_M,
) -> bool:
    """Say whether it is proven that no posture inside the position limits is at a placement.

    Args:
        robot: the robot.
        target: the placement of the task frame (`pinocchio.SE3`).
        tolerance: distance from it up to which a posture is there [m] (see `Embedding`).
        whole_pose: whether the orientation counts as well as the position.
        length: L of that distance [m].
    """
    chain = _chain(robot)
    if not chain:
        return False
    base = _base_point(chain)
    first = chain[0]
    z = float(base @ first.axis)
    where = [_Where((0.0, 0.0), (z, z), (abs(z), abs(z)), base)]
    for before, joint in pairwise(chain):
        moved = joint.placement.rotation @ joint.axis
        where.append(_about_next(where[-1], before, joint.placement, moved))
    flange = robot.model.frames[robot.frame_id].placement
    at_frame = _about_next(where[-1], chain[-1], flange, chain[-1].axis)
    world_base = first.placement.act(base)
    away = float(np.linalg.norm(target.translation - world_base))
    if not at_frame.r[0] - tolerance <= away <= at_frame.r[1] + tolerance:
        return True
    if not whole_pose:
        return False
    in_last = flange.act(target.actInv(world_base))
    return _no_cell_is_left(chain, where, flange, in_last, away, tolerance, length)


def _chain(robot: Robot) -> list[_Joint]:
    """Return the joints that carry the task frame; none where one of them is not revolute."""
    model, limits = robot.model, robot.limits
    data, chain = model.createData(), []
    pin.computeJointJacobians(model, data, pin.neutral(model))
    for index in list(model.supports[model.frames[robot.frame_id].parentJoint])[1:]:
        v = model.joints[index].idx_v
        if model.joints[index].nv != 1:
            return []
        J = pin.getJointJacobian(model, data, index, pin.LOCAL).reshape(6, -1)[:, v]
        if np.abs(J[:3]).max() > PARALLEL:
            return []
        lower, upper = -np.pi, np.pi
        if limits.position is not None and np.isfinite(limits.position.upper[v]):
            lower = float(limits.position.lower[v]) - ALLOWED_OUTSIDE
            upper = float(limits.position.upper[v]) + ALLOWED_OUTSIDE
        chain.append(_Joint(model.jointPlacements[index], J[3:], lower, upper))
    return chain


def _base_point(chain: list[_Joint]) -> Array:
    """Return the point of the first axis that is nearest to the second, in the first's frame."""
    axis = chain[0].axis
    if len(chain) == 1:
        return np.zeros(3)
    to, other = chain[1].placement.translation, chain[1].placement.rotation @ chain[1].axis
    along = float(axis @ other)
    sine_squared = 1 - along**2
    if sine_squared < PARALLEL:
        return float(to @ axis) * axis
    point: Array = float(to @ axis - along * (to @ other)) / sine_squared * axis
    return point


def _about_next(where: _Where, joint: _Joint, placement: Any, axis: Array) -> _Where:
    """Bound where the base point is about the next axis.

    Args:
        where: where it is about the joint's axis.
        joint: the joint, at any angle in its range.
        placement: of the next joint in this one's frame.
        axis: direction of the next one's axis in this one's frame, (3,).
    """
    to = placement.translation
    on_axis = where.rho[1] < ON_AXIS_M
    if where.point is not None:
        angles = np.zeros(1) if on_axis else np.linspace(joint.lower, joint.upper, ARC_SAMPLES)
        points = _turned(where.point, joint.axis, -angles) - to
        half_step = (joint.upper - joint.lower) / (ARC_SAMPLES - 1) / 2
        spread = where.rho[1] * (2.0 if on_axis else half_step)
        heights, distances = points @ axis, np.linalg.norm(points, axis=1)
        rho = np.sqrt(np.maximum(distances**2 - heights**2, 0.0))
        point = placement.actInv(where.point) if on_axis else None
        return _Where(
            _range(rho, spread), _range(heights, spread), _range(distances, spread), point
        )
    cosine, height = float(axis @ joint.axis), float(to @ joint.axis)
    sine = float(np.linalg.norm(np.cross(axis, joint.axis)))
    aside = float(np.linalg.norm(to - height * joint.axis))
    length, (z0, z1), (rho0, rho1) = float(np.linalg.norm(to)), where.z, where.rho
    heights = np.array([cosine * z0, cosine * z1]) - float(to @ axis)
    z = _range(heights, sine * rho1)
    # |p - c|^2 = |p|^2 + |c|^2 - 2 (z c_z + rho |c_across| cos phi)
    along = 2 * height * np.array([z0, z1])
    square = length**2 - along
    low = max(where.r[0] - length, length - where.r[1], 0.0)
    low = max(low, _root(where.r[0] ** 2 + float(square.min()) - 2 * rho1 * aside))
    high = where.r[1] + length
    high = min(high, _root(where.r[1] ** 2 + float(square.max()) + 2 * rho1 * aside))
    if sine < PARALLEL:
        rho_low, rho_high = max(rho0 - aside, aside - rho1, 0.0), rho1 + aside
    else:
        inside = 0.0 if z[0] <= 0.0 <= z[1] else min(abs(z[0]), abs(z[1]))
        outside = max(abs(z[0]), abs(z[1]))
        rho_low, rho_high = _root(low**2 - outside**2), _root(high**2 - inside**2)
    high = min(high, float(np.hypot(rho_high, max(abs(z[0]), abs(z[1])))))
    return _Where(
        (rho_low - ROUNDING_M, rho_high + ROUNDING_M),
        z,
        (low - ROUNDING_M, high + ROUNDING_M),
        None,
    )


def _no_cell_is_left(
    chain: list[_Joint],
    where: list[_Where],
    flange: Any,
    in_last: Array,
    away: float,
    tolerance: float,
    length: float,
) -> bool:
    """Divide the angles of the last joints into cells until all are excluded, or too many are not.

    Args:
        chain: the joints.
        where: where the base point is about each of their axes.
        flange: placement of the task frame in the last joint's frame.
        in_last: the base point in that frame where the task frame is at its target, (3,) [m].
        away: distance of the base point from the task frame [m].
        tolerance: distance from the target up to which a posture is there [m].
        length: L of that distance [m].
    """
    last = chain[::-1][: min(LAST_JOINTS, len(chain) - 1)]
    bounds = where[::-1]
    # A turn of the task frame by an angle moves the base point by as much times its distance, as
    # seen from there, and a joint's origin by as much times its own.
    turned = tolerance * float(np.hypot(1.0, away / length))
    lengths = [flange, *(joint.placement for joint in last)]
    levers = np.cumsum([float(np.linalg.norm(X.translation)) for X in lengths])
    moved = tolerance * np.hypot(1.0, levers / length)
    half = np.array([[(joint.upper - joint.lower) / 2 for joint in last]])
    centre = np.array([[(joint.upper + joint.lower) / 2 for joint in last]])
    while len(centre) and len(centre) <= CELLS_MOST:
        points, error = np.repeat(in_last[None], len(centre), axis=0), np.zeros(len(centre))
        open_ = _may_be(points, error, chain[-1].axis, bounds[0], turned, moved[0])
        for k, joint in enumerate(last):
            aside = np.linalg.norm(np.cross(points, joint.axis), axis=1)
            error = error + 2 * aside * np.sin(np.minimum(half[:, k], np.pi) / 2)
            points = _turned(points, joint.axis, centre[:, k])
            points = points @ joint.placement.rotation.T + joint.placement.translation
            axis = chain[len(chain) - 2 - k].axis
            open_ &= _may_be(points, error, axis, bounds[k + 1], turned, moved[k + 1])
        centre, half = centre[open_], half[open_]
        if not len(centre) or not last:
            return not len(centre)
        widest = half.argmax(axis=1)
        each = np.arange(len(half))
        if half[each, widest].min() < CELL_LEAST_RAD:
            return False
        half = half.copy()
        half[each, widest] /= 2
        shift = np.zeros_like(half)
        shift[each, widest] = half[each, widest]
        centre, half = np.vstack([centre - shift, centre + shift]), np.vstack([half, half])
    return False


def _may_be(
    points: Array, error: Array, axis: Array, where: _Where, turned: float, moved: float
) -> Any:
    """Say which of the points (n, 3), each known up to an error (n,), the bounds allow."""
    heights, distances = points @ axis, np.linalg.norm(points, axis=1)
    rho = np.linalg.norm(np.cross(points, axis), axis=1)
    allowed = np.ones(len(points), dtype=bool)
    for values, (low, high), more in (
        (heights, where.z, turned),
        (rho, where.rho, turned),
        (distances, where.r, moved),
    ):
        allowed &= (values + error + more >= low) & (values - error - more <= high)
    return allowed


def _turned(points: Array, axis: Array, angles: Array) -> Array:
    """Turn points (n, 3), or one (3,), about an axis by angles (n,) [rad] (Rodrigues)."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along = (points @ axis)[..., None] * axis
    turned: Array = cosine * (points - along) + sine * np.cross(axis, points) + along
    return turned


def _range(values: Array, spread: float) -> tuple[float, float]:
    """Return the range of values, wider by a spread and by rounding."""
    spread += ROUNDING_M
    return float(values.min()) - spread, float(values.max()) + spread


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
