"""The largest speeds from which a joint can still brake before a limit."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

UNBRAKED_DISTANCE_RAD: Final = 1e6
"""From here on a position limit does not bound the speed; keeps infinity out of formulas."""

LEAST_DECELERATION_RAD_S2: Final = 1e-9
"""Smaller decelerations are raised to this one, which keeps the number of braking steps finite."""


def viable_brake(distance: Array, deceleration: Array, dt: float) -> Array:
    """Compute the largest speed [rad/s] at `distance` [rad] from a limit that can still be stopped.

    Exact for q+ = q + v dt: braking by deceleration * dt per step it comes to rest on the limit or
    before it. Infinite where the distance or the deceleration is; 0 outside the limit.
    """
    braked = (distance < UNBRAKED_DISTANCE_RAD) & np.isfinite(deceleration)
    d = np.where(braked, np.maximum(distance, 0.0), 0.0)
    step = np.where(braked, np.maximum(deceleration, LEAST_DECELERATION_RAD_S2), 1.0) * dt
    k = np.floor(-0.5 + np.sqrt(0.25 + 2 * d / (step * dt)))
    speed = (d / dt + step * k * (k + 1) / 2) / (k + 1)
    return np.where(braked, speed, np.inf)


def sqrt_brake(distance: Array, deceleration: Array, dt: float) -> Array:
    """Compute sqrt(2 a d) [rad/s], the braking speed in continuous time, a the deceleration."""
    del dt  # the continuous-time bound does not know the control period
    braked = (distance < UNBRAKED_DISTANCE_RAD) & np.isfinite(deceleration)
    d = np.where(braked, np.maximum(distance, 0.0), 0.0)
    return np.where(braked, np.sqrt(2 * np.where(braked, deceleration, 0.0) * d), np.inf)
