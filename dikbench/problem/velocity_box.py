"""The velocity box: position, velocity and acceleration limits as bounds on one velocity.

    hi = min( vmax, v_prev + a dt, gain (q_max - q)/dt, brake(q_max - q) ),   lo mirrored,

all in tangent coordinates [rad/s or m/s], shape (nv,). There are four ways to brake before a
position limit at distance d, with a the deceleration in force:

* `one-step`: gain 1, no brake: the limit is not passed within this step.
* `gain`: a share of the distance per step (Pink 0.5, mink 0.95), no brake.
* `sqrt`: brake = sqrt(2 a d), the continuous-time bound (Flacco, De Luca & Khatib 2012; Pink). In
  discrete time it is not recursively feasible: kept for comparison.
* `viable`: the largest speed from which the joint can still stop in time when q+ = q + v dt:
  k = floor(-1/2 + sqrt(1/4 + 2 d/(a dt^2))), brake = (d/dt + a dt k (k+1)/2)/(k+1).

Without acceleration limits `sqrt` and `viable` are the same as `one-step`.

Where the bounds contradict each other, position limits take precedence over velocity limits and
those over acceleration limits; joints whose acceleration bound was given up are counted. Outside a
position limit the bound leads back inside: hi = max(d/dt, -v_back), v_back a tenth of the velocity
limit, or, where acceleration limits are in force, as fast as they allow: hi = max(d/dt, -v_back,
min(0, v_prev - a dt)).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Final, Literal, get_args

import msgspec
import numpy as np

from dikbench.arrays import Array, Indices, Mask
from dikbench.errors import unknown
from dikbench.robots.braking import (
    LEAST_DECELERATION_RAD_S2,
    UNBRAKED_DISTANCE_RAD,
    sqrt_brake,
    viable_brake,
)
from dikbench.robots.limits import JointLimits, Limits

Braking = Literal["one-step", "gain", "sqrt", "viable"]
BRAKINGS: Final = get_args(Braking)

ROUNDING_SPEED_RAD_S: Final = 1e-9
"""An acceleration bound exceeded by at most this much counts as kept."""

ROUNDING_ALLOWANCE: Final = 1e-9
"""Allowance for rounding in a distance: as a share of it, and in addition [rad]."""


class Box(msgspec.Struct, eq=False):
    """Bounds on the velocity of one control step.

    Attributes:
        lower, upper: (nv,) [rad/s or m/s], lower <= upper, infinite where nothing is in force;
            treat as read-only: away from limits every step has the same two arrays. Of many
            control steps (N, nv), or (nv,) where all have the same.
        relaxed: number of joints whose acceleration bound had to be given up, one or (N,).
    """

    lower: Array
    upper: Array
    relaxed: int | Indices


def velocity_box(
    limits: Limits,
    v_prev: Array | None,
    dt: float,
    braking: Braking = "viable",
    position_gain: float = 0.5,
) -> Box:
    """Compute the box at one configuration, or at each of many.

    Args:
        limits: the limits in force, as seen from the configuration.
        v_prev: the velocity applied last, (nv,) or (N, nv) [rad/s or m/s]; None: no acceleration
            bound.
        dt: control period [s].
        braking: how to approach a position limit.
        position_gain: share of the distance per step for `gain`.

    Raises:
        DikbenchError: on an unknown braking.
    """
    joint = limits.joint
    inside = _interior(joint, dt, braking, position_gain)
    if inside is None or not inside.holds(limits.coordinates):
        lower, upper = _without_acceleration(limits, dt, braking, position_gain)
    elif v_prev is None or inside.slowest is None or inside.fastest is None:
        return inside.box
    else:
        lower = np.maximum(inside.box.lower, v_prev + inside.slowest)
        upper = np.minimum(inside.box.upper, v_prev + inside.fastest)
        if not _any(lower > upper):
            return Box(lower, upper, 0)
        lower, upper = inside.box.lower, inside.box.upper
    if joint.acceleration is None or v_prev is None:
        return Box(lower, upper, 0)
    slowest = v_prev + joint.acceleration.lower * dt
    fastest = v_prev + joint.acceleration.upper * dt
    to_lower, to_upper = limits.to_lower, limits.to_upper
    if to_lower is not None and to_upper is not None:
        # Outside, a joint may not move farther out, and is asked back no faster than it can.
        upper = np.where(to_upper < 0, np.maximum(upper, np.minimum(slowest, 0)), upper)
        lower = np.where(to_lower < 0, np.minimum(lower, np.maximum(fastest, 0)), lower)
    return _with_acceleration(lower, upper, slowest, fastest)


def _without_acceleration(
    limits: Limits, dt: float, braking: Braking, position_gain: float
) -> tuple[Array, Array]:
    """Compute the bounds of position and velocity limits, (nv,) each."""
    joint = limits.joint
    gain = position_gain if braking == "gain" else 1.0
    to_lower, to_upper = limits.to_lower, limits.to_upper
    if to_lower is None or to_upper is None:
        upper = np.full(joint.nv, np.inf)
        lower = -upper
    else:
        upper = to_upper * (gain / dt)
        lower = to_lower * (-gain / dt)
        if braking in BRAKES and joint.acceleration is not None:
            slow_up, slow_down = -joint.acceleration.lower, joint.acceleration.upper
            brake = BRAKES[braking]
            upper = np.minimum(upper, brake(to_upper, slow_up, dt))
            lower = np.maximum(lower, -brake(to_lower, slow_down, dt))
        if to_upper.min() < 0 or to_lower.min() < 0:
            _lead_back_inside(joint, to_lower, to_upper, upper, lower, dt)
    if joint.velocity is not None:
        upper = np.minimum(upper, joint.velocity.upper)
        lower = np.maximum(lower, joint.velocity.lower)
    return lower, upper


class _Interior:
    """The coordinates (nv,), from `above` to `below`, where no position limit bounds the velocity.

    Many are inside where all are.

    There the box is the velocity limits (and acceleration limits about v_prev), which takes a tenth
    of the time (a third of a step of `qp` in all).
    """

    __slots__ = ("above", "below", "box", "fastest", "slowest")

    def __init__(self, joint: JointLimits, dt: float, braking: Braking, gain: float) -> None:
        assert joint.velocity is not None
        lower, upper = joint.velocity.lower.copy(), joint.velocity.upper.copy()
        lower.flags.writeable = upper.flags.writeable = False
        self.box = Box(lower, upper, 0)
        self.slowest = self.fastest = None
        deceleration = np.full(joint.nv, np.inf), np.full(joint.nv, np.inf)
        if joint.acceleration is not None:
            self.slowest = joint.acceleration.lower * dt
            self.fastest = joint.acceleration.upper * dt
            deceleration = joint.acceleration.upper, -joint.acceleration.lower
        self.above: Array | None = None
        self.below: Array | None = None
        if joint.position is not None:
            with np.errstate(
                invalid="ignore", divide="ignore"
            ):  # without a limit the distance is infinite
                below = _reach(upper, deceleration[1], dt, braking, gain)
                above = _reach(-lower, deceleration[0], dt, braking, gain)
                self.above = joint.position.lower + above
                self.below = joint.position.upper - below

    def holds(self, coordinates: Array | None) -> bool:
        """Say whether coordinates (nv,) or (N, nv) are inside."""
        if self.above is None or self.below is None or coordinates is None:
            return True
        return _all(coordinates > self.above) and _all(coordinates < self.below)


@lru_cache(maxsize=256)
def _interior(joint: JointLimits, dt: float, braking: Braking, gain: float) -> _Interior | None:
    """Return the interior of these limits, or None where the distance matters everywhere.

    Raises:
        DikbenchError: on an unknown braking.
    """
    if braking not in BRAKINGS:
        raise unknown("braking", braking, BRAKINGS)
    return None if joint.velocity is None else _Interior(joint, dt, braking, gain)


def _any(mask: Mask) -> bool:
    """Say whether anything of a mask holds; of one step alone lists are faster than numpy."""
    return True in mask.tolist() if mask.ndim == 1 else bool(mask.any())


def _all(mask: Mask) -> bool:
    """Say whether everything of a mask holds (see `_any`)."""
    return False not in mask.tolist() if mask.ndim == 1 else bool(mask.all())


def _reach(speed: Array, deceleration: Array, dt: float, braking: Braking, gain: float) -> Array:
    """Compute the distance (nv,) [rad] from which a position limit allows a speed (nv,) [rad/s].

    It is the inverse of the bounds, which grow with the distance, plus an allowance for rounding.
    """
    if braking == "gain":
        distance = speed * dt / gain
    elif braking == "one-step":
        distance = speed * dt
    else:
        slow = np.maximum(deceleration, LEAST_DECELERATION_RAD_S2)
        if braking == "sqrt":
            distance = speed**2 / (2 * slow)
        else:
            k = np.floor(speed / (slow * dt))
            distance = dt * ((k + 1) * speed - np.where(k > 0, slow, 0.0) * dt * k * (k + 1) / 2)
        distance = np.maximum(speed * dt, np.minimum(distance, UNBRAKED_DISTANCE_RAD))
    return distance * (1 + ROUNDING_ALLOWANCE) + ROUNDING_ALLOWANCE


BRAKES: Final[Mapping[str, Callable[[Array, Array, float], Array]]] = MappingProxyType(
    {"sqrt": sqrt_brake, "viable": viable_brake}
)
"""(distance (nv,) [rad], deceleration (nv,) [rad/s^2], dt [s]) -> speed (nv,) [rad/s]."""


def _lead_back_inside(
    joint: JointLimits, to_lower: Array, to_upper: Array, upper: Array, lower: Array, dt: float
) -> None:
    """Overwrite the bounds of joints outside a position limit, in place."""
    above, below = to_upper < 0, to_lower < 0
    upper[above] = to_upper[above] / dt
    lower[below] = -to_lower[below] / dt
    way_back = joint.way_back
    if way_back is not None:
        up, down = way_back
        upper[above] = np.maximum(upper, -down)[above]
        lower[below] = np.minimum(lower, up)[below]
    # In a narrow range the way back must not run through the limit on the other side.
    upper[above] = np.maximum(upper[above], lower[above])
    lower[below] = np.minimum(lower[below], upper[below])


def _with_acceleration(lower: Array, upper: Array, slowest: Array, fastest: Array) -> Box:
    """Intersect with [slowest, fastest]; take the nearest allowed velocity where empty."""
    gap = np.maximum(slowest - upper, lower - fastest)
    given_up = gap > ROUNDING_SPEED_RAD_S
    relaxed: Any = np.count_nonzero(given_up, axis=-1 if gap.ndim == 2 else None)
    return Box(np.clip(slowest, lower, upper), np.clip(fastest, lower, upper), relaxed)
