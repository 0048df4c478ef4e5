"""The limits of a robot's joints, and how far one configuration is from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import msgspec
import numpy as np

from dikbench.arrays import Array, Indices, read_only
from dikbench.errors import DikbenchError

NO_LIMIT_MAGNITUDE = 1e20
"""A limit above this is none: some models carry the largest double instead of infinity."""

WAY_BACK_SPEED_SHARE = 0.1
"""Share of the velocity limits at which a violated limit or distance is left."""


@dataclass(frozen=True, slots=True, eq=False)
class Interval:
    """A lower and an upper bound per joint, (nv,) each, infinite where a joint has none."""

    lower: Array
    upper: Array

    def __post_init__(self) -> None:
        """Copy the bounds and make them read-only: all steps and trials share them."""
        for side in ("lower", "upper"):
            bound = np.array(getattr(self, side), dtype=float)
            bound.flags.writeable = False
            object.__setattr__(self, side, bound)

    def usage(self, values: Array) -> Array:
        """Divide values (..., nv) by the bound on their side; infinite past a bound of zero."""
        bound = np.abs(np.where(values > 0, self.upper, self.lower))
        with np.errstate(divide="ignore"):
            share: Array = np.divide(
                np.abs(values), bound, out=np.zeros_like(values), where=values != 0
            )
        return share


@dataclass(frozen=True, eq=False)
class JointLimits:
    """The limits of a robot's joints in tangent coordinates; a kind not in force is None.

    Attributes:
        nv: number of velocities.
        q_index: index into q of each velocity's coordinate, shape (nv,); -1 where the joint can
            have no position limit (continuous joints, free-flyers).
        position: bounds on that coordinate [rad or m], or None.
        velocity: bounds [rad/s or m/s], or None.
        acceleration: bounds [rad/s^2 or m/s^2], or None.
        effort: bounds [N m or N], or None.
    """

    nv: int
    q_index: Indices
    position: Interval | None
    velocity: Interval | None
    acceleration: Interval | None
    effort: Interval | None

    def with_interval(self, kind: str, value: object) -> JointLimits:
        """Replace one kind of limit.

        Args:
            kind: "position", "velocity", "acceleration" or "effort".
            value: None (not in force), a magnitude for all joints or one per joint (symmetric),
                or a pair (lower, upper) of such.

        Raises:
            DikbenchError: on a wrong shape, NaN, a lower bound above the upper one, (but for
                positions) an interval that does not contain zero, or a finite position limit of
                a joint that can have none.
        """
        if value is None:
            return self._replaced(kind, None)
        if isinstance(value, tuple):
            if len(value) != 2:
                raise DikbenchError(
                    f"{kind} limit: a tuple means (lower, upper), got {len(value)} entries"
                )
            lower, upper = (self._vector(kind, side) for side in value)
        else:
            upper = self._vector(kind, value)
            lower = -upper
        if np.any(lower > upper):
            raise DikbenchError(f"{kind} limit: a lower bound is above its upper bound")
        if kind != "position" and (np.any(lower > 0) or np.any(upper < 0)):
            raise DikbenchError(f"{kind} limit: every interval must contain zero (rest)")
        limitless = (self.q_index < 0) & (np.isfinite(lower) | np.isfinite(upper))
        if kind == "position" and limitless.any():
            raise DikbenchError(
                "position limit: continuous joints and free-flyers can have none; expected inf at "
                f"{np.flatnonzero(limitless).tolist()}"
            )
        return self._replaced(kind, Interval(lower, upper))

    def of_joints(self, kept: Indices, coordinates: Indices) -> JointLimits:
        """Return the limits of some joints.

        Args:
            kept: their indices into v.
            coordinates: the indices into q that are theirs.
        """
        renumbered = {int(old): new for new, old in enumerate(coordinates)}
        q_index = [renumbered[k] if k >= 0 else -1 for k in self.q_index[kept].tolist()]

        def of(interval: Interval | None) -> Interval | None:
            return interval and Interval(interval.lower[kept], interval.upper[kept])

        return JointLimits(
            nv=len(kept),
            q_index=np.array(q_index),
            position=of(self.position),
            velocity=of(self.velocity),
            acceleration=of(self.acceleration),
            effort=of(self.effort),
        )

    def _replaced(self, kind: str, interval: Interval | None) -> JointLimits:
        changed: dict[str, Any] = {kind: interval}
        return replace(self, **changed)

    def _vector(self, kind: str, value: object) -> Array:
        try:
            if isinstance(value, bool):
                raise TypeError
            vector = np.asarray(value, dtype=float)
            if vector.ndim == 0:
                vector = np.full(self.nv, float(vector))
        except (TypeError, ValueError):
            raise DikbenchError(f"{kind} limit: expected numbers, got {value!r}") from None
        if vector.shape != (self.nv,) or np.isnan(vector).any():
            got = "NaN" if np.isnan(vector).any() else f"shape {vector.shape}"
            raise DikbenchError(
                f"{kind} limit: expected a number or {self.nv} numbers without NaN, got {got}"
            )
        return np.where(np.abs(vector) > NO_LIMIT_MAGNITUDE, np.copysign(np.inf, vector), vector)

    @cached_property
    def way_back(self) -> tuple[Array, Array] | None:
        """Largest speeds at which a violated lower and upper position limit is left [rad/s].

        It is `WAY_BACK_SPEED_SHARE` of the velocity limit; None where none is in force.
        """
        if self.velocity is None:
            return None
        share = WAY_BACK_SPEED_SHARE
        return share * self.velocity.upper, -share * self.velocity.lower

    @cached_property
    def middle(self) -> Array | None:
        """Middle of the position limits, (nv,) [rad or m], NaN where a joint lacks one.

        None where position limits are not in force.
        """
        if self.position is None:
            return None
        lower, upper = self.position.lower, self.position.upper
        limited = np.isfinite(lower) & np.isfinite(upper)
        middle = np.full(self.nv, np.nan)
        middle[limited] = (lower[limited] + upper[limited]) / 2
        middle.flags.writeable = False
        return middle

    def at(self, q: Array) -> Limits:
        """Return the limits as seen from configuration q (nq,); the plant's limits are these."""
        return Limits(self, None if self.position is None else read_only(q[self.q_index]))


class Limits(msgspec.Struct, eq=False):
    """The limits of a robot's joints as seen from one configuration.

    Attributes:
        joint: the limits in force (velocity, acceleration, effort).
        coordinates: the coordinates that position limits bound, one per velocity, (nv,) [rad or m];
            None where position limits are not in force.
    """

    joint: JointLimits
    coordinates: Array | None

    @property
    def to_lower(self) -> Array | None:
        """Distance to the lower position limits in the tangent space, q - q_min [rad or m], (nv,).

        Negative outside; None where position limits are not in force.
        """
        if self.coordinates is None or self.joint.position is None:
            return None
        return self.coordinates - self.joint.position.lower

    @property
    def to_upper(self) -> Array | None:
        """Distance to the upper position limits, q_max - q (see `to_lower`)."""
        if self.coordinates is None or self.joint.position is None:
            return None
        return self.joint.position.upper - self.coordinates
