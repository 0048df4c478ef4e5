"""The smallest capsule around a set of points, whose distance is cheap and smooth."""

from __future__ import annotations

from math import pi

import numpy as np

from dikbench.arrays import Array

CIRCLE_ITERATIONS = 200
"""Steps of the algorithm of Badoiu & Clarkson, whose centre is then off by 1/200 of the radius."""

RADIUS_ALLOWANCE_M = 1e-9
"""Added to the radius, so that rounding leaves no point outside."""


def enclosing_capsule(points: Array) -> tuple[Array, Array, float]:
    """Compute the smallest capsule along a principal axis that contains every point.

    Args:
        points: (n, 3) [m].

    Returns:
        The ends (3,), (3,) of its segment [m], equal for a sphere, and its radius [m].
    """
    middle = points.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((points - middle).T))
    candidates = [_along(points - middle, axes[:, number]) for number in range(3)]
    start, end, radius = min(candidates, key=_volume)
    return middle + start, middle + end, radius


def _along(points: Array, axis: Array) -> tuple[Array, Array, float]:
    """Compute the capsule about points (n, 3) whose segment is along a unit vector (3,)."""
    height = points @ axis
    flat = points - np.outer(height, axis)
    centre = _circle_centre(flat)
    off_axis = np.linalg.norm(flat - centre, axis=1)
    radius = float(off_axis.max())
    # A point may lie in the cap beyond the segment, as far as its distance from the axis allows.
    cap = np.sqrt(np.maximum(radius**2 - off_axis**2, 0.0))
    low, high = float((height + cap).min()), float((height - cap).max())
    if low > high:  # a sphere about any point between them contains all
        low = high = (low + high) / 2
    return centre + low * axis, centre + high * axis, radius + RADIUS_ALLOWANCE_M


def _circle_centre(points: Array) -> Array:
    """Approximate the centre (3,) of the smallest circle about points (n, 3) of a plane."""
    centre: Array = points.mean(axis=0)
    for number in range(1, CIRCLE_ITERATIONS):
        away = points - centre
        farthest = int(np.einsum("ij,ij->i", away, away).argmax())
        centre = centre + away[farthest] / (number + 1)
    return centre


def _volume(capsule: tuple[Array, Array, float]) -> float:
    start, end, radius = capsule
    return pi * radius**2 * (float(np.linalg.norm(end - start)) + 4 / 3 * radius)
