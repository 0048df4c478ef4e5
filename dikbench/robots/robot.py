"""A robot: a Pinocchio model with its task frame, its limits and a safe start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array, Indices
from dikbench.errors import DikbenchError, unknown
from dikbench.robots.limits import NO_LIMIT_MAGNITUDE, Interval, JointLimits
from dikbench.robots.task_rows import ALL_ROWS, Axes

UNCHANGED: Final[Any] = object()

UNIT_NORM_TOLERANCE: Final = 1e-3
"""Largest error of the norm of (cos, sin) or a quaternion, which comes from rounded digits."""

UNIT_NORM_ROUNDING: Final = 1e-9
"""A smaller error of such a norm is the rounding of a computation."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot model as the harness and formulations see it.

    Attributes:
        name: the name under which it was loaded.
        model: the Pinocchio model, fingers and other passive joints locked.
        frame: name of the task frame, in which twists are expressed.
        limits: the limits of the joints that are in force.
        q0: a safe start, shape (nq,): inside the limits, away from singularities.
        task_rows: the rows of the task frame's twist (linear; angular) that are asked for: all six
            in space, (0, 1, 5) for an arm in the x-y plane. Pose tasks are restricted to them.
        movable_rows: the rows of the body twist that the arm can move, whatever is asked for.
        task_axes: the axes in which these rows are counted, the task frame's or the world's.
        available_acceleration: acceleration limits [rad/s^2] known for this robot, shape (nv,),
            in force only where a scenario or `with_limits` says so; None where none are known.
        visuals: builds its visual geometry (`pinocchio.GeometryModel`); may raise ValueError where
            a mesh is missing; None where the robot has none.
        urdf: the file of the model and its collision geometry; None if built in code.
        srdf: the file that lists which links cannot collide, or None.
        payload_radius: radius of the ball that it carries about the task frame [m]; 0 for none.
    """

    name: str
    model: Any
    frame: str
    limits: JointLimits
    q0: Array
    task_rows: tuple[int, ...] = ALL_ROWS
    task_axes: Axes = "body"
    movable_rows: tuple[int, ...] = ALL_ROWS
    available_acceleration: Array | None = None
    visuals: Callable[[], Any] | None = None
    urdf: str | None = None
    srdf: str | None = None
    payload_radius: float = 0.0

    def __post_init__(self) -> None:
        """Check and copy the start and make it read-only: all trials share it."""
        start = self.configuration(self.q0, f"robot {self.name}: start")
        start.flags.writeable = False
        object.__setattr__(self, "q0", start)

    @cached_property
    def frame_id(self) -> int:
        """Return Pinocchio's index of a frame of a model."""
        return frame_id(self.model, self.frame)

    @cached_property
    def available_effort(self) -> Array:
        """The model's effort limits, (nv,) [N m or N], infinite where it has none.

        In force only where a scenario or `with_limits(effort=...)` says so.
        """
        return _symmetric(self.model.effortLimit).upper

    @cached_property
    def scratch(self) -> Any:
        """A `pinocchio.Data` for whoever reads its results before calling anything else."""
        return self.model.createData()

    @cached_property
    def nq(self) -> int:
        """Number of configuration coordinates."""
        return int(self.model.nq)

    @cached_property
    def nv(self) -> int:
        """Number of velocities."""
        return int(self.model.nv)

    @cached_property
    def chain(self) -> Indices:
        """Indices into v of the velocities that move the task frame, without a gripper's."""
        joints = [self.model.joints[index] for index in self._carrying]
        moved = {joint.idx_v + k for joint in joints for k in range(joint.nvExtended)}
        return np.array(sorted(moved), dtype=np.intp)

    @cached_property
    def _carrying(self) -> list[int]:
        """Pinocchio's indices of the joints that move the task frame, from the root on."""
        return list(self.model.supports[self.model.frames[self.frame_id].parentJoint])[1:]

    @cached_property
    def shoulder(self) -> Array:
        """Origin of the first joint that moves the task frame, (3,) [m], in the world."""
        origin: Array = self.model.jointPlacements[self._carrying[0]].translation
        return origin

    @cached_property
    def joint_scale(self) -> Array:
        """Displacement of each joint that counts like one radian, (nv,).

        1 where a joint turns or has no end; 1/(2 pi) of its range [m] where it slides.
        """
        scale, position = np.ones(self.nv), self.limits.position
        for joint in self.model.joints:
            sliding = joint.shortname().startswith(("JointModelPX", "JointModelPY", "JointModelPZ"))
            sliding = sliding or joint.shortname() == "JointModelPrismaticUnaligned"
            if sliding and position is not None:
                stroke = position.upper[joint.idx_v] - position.lower[joint.idx_v]
                if 0 < stroke < np.inf:
                    scale[joint.idx_v] = stroke / (2 * np.pi)
        return scale

    def reach_of(self, placement: Any) -> float:
        """Compute the distance [m] of a placement (`pinocchio.SE3`) from the first joint."""
        return float(np.linalg.norm(placement.translation - self.shoulder))

    def inside(self, q: Array) -> Array:
        """Return a configuration (nq,), with joints outside their position limits moved there."""
        position, index = self.limits.position, self.limits.q_index
        if position is None:
            return q
        limited, moved = index >= 0, q.copy()
        moved[index[limited]] = np.clip(
            q[index[limited]], position.lower[limited], position.upper[limited]
        )
        return moved

    def with_limits(
        self,
        *,
        position: object = UNCHANGED,
        velocity: object = UNCHANGED,
        acceleration: object = UNCHANGED,
        effort: object = UNCHANGED,
    ) -> Robot:
        """Return the same robot with other limits in force.

        Args:
            position: None (not in force) or a pair (lower, upper) [rad or m].
            velocity: None, a magnitude, one per joint, or a pair (lower, upper) [rad/s].
            acceleration: the same [rad/s^2].
            effort: the same [N m].

        Raises:
            DikbenchError: on a wrong shape, NaN, or bounds that exclude rest.
        """
        limits = self.limits
        given = {
            "position": position,
            "velocity": velocity,
            "acceleration": acceleration,
            "effort": effort,
        }
        for kind, value in given.items():
            if value is not UNCHANGED:
                limits = limits.with_interval(kind, value)
        return replace(self, limits=limits)

    def configuration(self, q: object, what: str = "q") -> Array:
        """Check a configuration that came from outside and return it as a new array (nq,).

        The (cos, sin) of continuous joints and quaternions are brought to norm 1 from rounded
        digits.

        Raises:
            DikbenchError: on a wrong shape, NaN or infinity, or a norm that is not 1.
        """
        vector = checked_vector(q, self.nq, what)
        self.check_norms(vector, what)
        if not pin.isNormalized(self.model, vector, UNIT_NORM_ROUNDING):
            vector = pin.normalize(self.model, vector)
        return vector

    def check_norms(self, q: Array, what: str) -> None:
        """Check that (cos, sin) and quaternions in finite coordinates (nq,) have norm 1.

        Raises:
            DikbenchError: if one has not, and names its joint.
        """
        model = self.model
        if self.nq == self.nv or pin.isNormalized(model, q, UNIT_NORM_TOLERANCE):
            return
        if not np.isfinite(q).all():
            return
        for name, joint in zip(model.names, model.joints, strict=True):
            alone, own = pin.neutral(model), slice(joint.idx_q, joint.idx_q + joint.nq)
            alone[own] = q[own]
            if not pin.isNormalized(model, alone, UNIT_NORM_TOLERANCE):
                raise DikbenchError(
                    f"{what}: the coordinates of joint {name!r} hold a (cos, sin) or a quaternion, "
                    f"whose norm must be 1, got {q[own].tolist()}"
                )


def frame_id(model: Any, frame: str) -> int:
    """Return Pinocchio's index of a frame of a model.

    Raises:
        DikbenchError: if the model has no frame of this name.
    """
    if not model.existFrame(frame):
        frames = sorted({f.name for f in model.frames} - {"universe"})
        raise unknown("frame", frame, frames, f"of robot {model.name!r}")
    # A joint and a link may have one name: the link is meant.
    body = pin.FrameType.BODY
    if model.existFrame(frame, body):
        return int(model.getFrameId(frame, body))
    return next(index for index, each in enumerate(model.frames) if each.name == frame)


def checked_vector(value: object, size: int, what: str) -> Array:
    """Return a copy of a finite vector of the given size.

    Raises:
        DikbenchError: on a wrong size, NaN, infinity, or what is not a number.
    """
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise DikbenchError(f"{what}: expected {size} numbers, got {value!r}") from None
    if vector.shape != (size,):
        raise DikbenchError(f"{what}: expected shape ({size},), got {vector.shape}")
    if not np.isfinite(vector).all():
        raise DikbenchError(f"{what}: expected finite numbers, got {vector.tolist()}")
    return vector


def model_limits(model: Any) -> JointLimits:
    """Read position, velocity and effort limits off a Pinocchio model.

    Joints with one coordinate and one velocity have position limits; continuous joints, planar
    joints and free-flyers have none (the artificial bounds that some models carry are dropped).
    A velocity or effort limit of zero means that the model has none.
    """
    nv = model.nv
    q_index = np.full(nv, -1)
    lower, upper = np.full(nv, -np.inf), np.full(nv, np.inf)
    for joint in model.joints:
        # The first one is the universe, a revolute joint with index -1.
        if joint.idx_v >= 0 and joint.nq == 1 and joint.nv == 1:
            q_index[joint.idx_v] = joint.idx_q
            lower[joint.idx_v] = model.lowerPositionLimit[joint.idx_q]
            upper[joint.idx_v] = model.upperPositionLimit[joint.idx_q]
    lower[np.abs(lower) > NO_LIMIT_MAGNITUDE] = -np.inf
    upper[np.abs(upper) > NO_LIMIT_MAGNITUDE] = np.inf
    return JointLimits(
        nv=nv,
        q_index=q_index,
        position=Interval(lower, upper),
        velocity=_symmetric(model.velocityLimit),
        acceleration=None,
        effort=_symmetric(model.effortLimit),
    )


def _symmetric(magnitude: Array) -> Interval:
    # Pinocchio 4.1 fills lowerVelocityLimit of a URDF with the positive magnitude: not read.
    upper = np.array(magnitude, dtype=float)
    upper[(upper == 0) | (upper > NO_LIMIT_MAGNITUDE)] = np.inf
    return Interval(-upper, upper)
