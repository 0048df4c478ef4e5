"""A smooth path through placements at given times: cubic splines of position and orientation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import pinocchio as pin
from scipy.linalg import solve_banded

from dikbench.arrays import Array, Mask
from dikbench.scenario.reference.reference import Placed, Placement, Reference
from dikbench.scenario.reference.screws import exp3
from dikbench.scenario.reference.waypoints import segment_at, segments_at

SAME_PLACEMENT: Final = 1e-12
"""Placements whose entries differ by no more are one."""

STEEPEST: Final = 3.0
"""The speed at a row is at most so many times that from it to either neighbour: a cubic whose ends
are no steeper passes neither of them (Fritsch & Carlson 1980)."""

ALIKE: Final = 0.5
"""Accelerations that are within this share of their mean are those of one smooth motion."""

NEGLIGIBLE_SPEED: Final = 1e-12
"""Rounding of speeds [m/s or rad/s]."""

LEVER_M: Final = 0.2
"""Weighs rotations against translations."""


def spline_through(times: Sequence[float], placements: Sequence[Any]) -> Reference:
    """Interpolate positions and orientations by cubic splines.

        p(tau) = p_k + s(u),   R(tau) = exp3(r(u)) R_k,   u = (tau - t_k) / (t_k+1 - t_k)

    s and r are cubics in u, in the axes of the world; their derivatives at the rows are velocities
    that make the acceleration continuous (the angular one up to the square of the angle between
    rows), and the third derivative next to either end (de Boor 1978). Where rows are too few for
    what happens between them, the velocities are smaller, so that the path does not run past a row
    and back: next to a jump, or to two rows that are close in time, the velocity is continuous and
    the acceleration is not. Two rows of one placement are a rest, unless they stand on either
    side of a turning point.

    Args:
        times: increasing, from 0 on, at least two [s].
        placements: one per time (`pinocchio.SE3`).
    """
    spans = np.diff(times)[:, None]
    p = np.array([X.translation for X in placements])
    R = np.array([X.rotation for X in placements])
    ways = np.diff(p, axis=0)
    turns = np.array([there @ pin.log3(here.T @ there) for here, there in pairwise(R)])
    rest = _rests(spans, ways, turns)
    # d exp3(r) = (J(r) dr) exp3(r): the inverses of J at the end, about either end of a segment.
    charts = np.array([[pin.Jlog3(pin.exp3(-r)), pin.Jlog3(pin.exp3(r))] for r in turns])
    straight = np.broadcast_to(np.eye(3), charts.shape)
    v = _velocities(spans, ways / spans, straight, rest)
    w = _velocities(spans, turns / spans, charts, rest)
    whole = np.stack([ways, turns], axis=1)
    first = spans[:, None] * np.stack([v[:-1], w[:-1]], axis=1)
    last = spans[:, None] * np.stack([v[1:], np.einsum("kij,kj->ki", charts[:, 0], w[1:])], axis=1)
    third = first + last - 2 * whole
    second = whole - first - third

    def placement(tau: float) -> Any:
        k, u = segment_at(times, tau)
        s, r = u * (first[k] + u * (second[k] + u * third[k]))
        return pin.SE3(pin.exp3(r) @ R[k], p[k] + s)

    def many(at: Array) -> Placed:
        k, u = segments_at(times, at)
        u = u[:, None, None]
        parts = u * (first[k] + u * (second[k] + u * third[k]))
        return exp3(parts[:, 1]) @ R[k], p[k] + parts[:, 0]

    def velocity(tau: float) -> Array:
        k, u = segment_at(times, tau)
        _, r = u * (first[k] + u * (second[k] + u * third[k]))
        ds, dr = (first[k] + u * (2 * second[k] + u * 3 * third[k])) / spans[k]
        to_body = (pin.exp3(r) @ R[k]).T
        twist: Array = np.concatenate([to_body @ ds, to_body @ pin.Jexp3(-r) @ dr])
        return twist

    return Reference(float(times[-1]), Placement(placement, many), velocity)


def _rests(spans: Array, ways: Array, turns: Array) -> Mask:
    """Find the rows at which the path rests: those whose placement a neighbour has, (n,).

    Not where the accelerations before, between and after the two are alike: a turning point.
    """
    still = np.abs(np.hstack([ways, turns])).max(axis=1) <= SAME_PLACEMENT
    D = _accelerations(spans, np.hstack([ways, LEVER_M * turns]) / spans)
    for k in np.flatnonzero(still):
        if 2 <= k <= len(still) - 3:
            about = D[k - 2 : k + 2]
            away = np.linalg.norm(about - about.mean(axis=0), axis=1).max()
            still[k] = away > ALIKE * np.linalg.norm(about.mean(axis=0))
    rest: Mask = np.append(still, False) | np.insert(still, 0, False)
    return rest


def _accelerations(spans: Array, d: Array) -> Array:
    """Compute half the accelerations about the inner rows, (n - 2, .)."""
    D: Array = np.diff(d, axis=0) / (spans[:-1] + spans[1:])
    return D


def _velocities(spans: Array, d: Array, charts: Array, rest: Mask) -> Array:
    """Compute the velocities at the rows, (n, 3) [m/s or rad/s].

    Those of a spline; but rows at which it is too fast, the worst of them first, have the smaller
    of the mean velocities on either side, and the spline begins anew there.

    Args:
        spans: h_k, (n - 1, 1) [s].
        d: mean velocities of the segments, (n - 1, 3).
        charts: see `_spline_velocities`.
        rest: rows where the velocity is 0, (n,).
    """
    most = _fastest(spans, d)
    most = np.minimum(np.append(most, np.inf), np.insert(most, 0, np.inf))
    sizes = np.linalg.norm(d, axis=1)
    smaller = np.where((sizes[:-1] < sizes[1:])[:, None], d[:-1], d[1:])
    turning = np.einsum("ij,ij->i", d[:-1], d[1:]) <= 0
    slow = np.vstack([d[:1], np.where(turning[:, None], 0.0, smaller), d[-1:]])
    given = np.where(rest[:, None], np.zeros(3), np.nan)
    while True:
        v = _spline_velocities(spans, d, charts, given)
        over = np.linalg.norm(v, axis=1) / (most + NEGLIGIBLE_SPEED)
        over[~np.isnan(given[:, 0])] = 0.0
        beside = np.maximum(np.append(over[1:], 0.0), np.insert(over[:-1], 0, 0.0))
        worst = (over > 1) & (over >= beside / 2)
        if not worst.any():
            return v
        given[worst] = slow[worst]


def _spline_velocities(spans: Array, d: Array, charts: Array, given: Array) -> Array:
    """Compute velocities that make the acceleration continuous, (n, 3).

        a_k A_k-1 v_k-1 + 2 v_k + b_k B_k v_k+1 = 3 (a_k d_k-1 + b_k d_k),
        a_k = h_k / (h_k-1 + h_k),   b_k = 1 - a_k

    at the inner rows.

    Args:
        spans: see `_velocities`.
        d: see there.
        charts: B_k, which takes the velocity at the end of a segment to the chart about its
            beginning, and A_k, which does the reverse, (n - 1, 2, 3, 3).
        given: velocities at single rows, NaN at the others, (n, 3).
    """
    n, one, fixed = len(d) + 1, np.eye(3), ~np.isnan(given[:, 0])
    before, own, after = np.zeros((3, n, 3, 3))
    right = np.empty((n, 3))
    B, A = charts[:, 0], charts[:, 1]
    a = spans[1:] / (spans[:-1] + spans[1:])
    b = 1 - a
    before[1:-1], own[1:-1], after[1:-1] = a[:, None] * A[:-1], 2 * one, b[:, None] * B[1:]
    right[1:-1] = 3 * (a * d[:-1] + b * d[1:])
    for end, inner, beside, chart, shares in ((0, 1, after, A, a), (-1, -2, before, B, b)):
        if n == 2 or fixed[inner]:  # a segment by itself: constant velocity
            own[end], right[end] = one, d[end]
        elif n == 3 or fixed[2 * inner - end]:  # two segments: a parabola
            own[end], beside[end], right[end] = chart[end], one, 2 * d[end]
        else:
            share = float(shares[end, 0])
            own[end], beside[end] = share * chart[end], one
            right[end] = (3 - share) * share * d[end] + (1 - share) ** 2 * d[inner]
    before[fixed], own[fixed], after[fixed], right[fixed] = 0.0, one, 0.0, given[fixed]
    return _solved(before, own, after, right)


def _fastest(spans: Array, d: Array) -> Array:
    """Compute the largest speed at the ends of each segment, (n - 1,) [m/s or rad/s].

    It is `STEEPEST` times the mean speed, with what an acceleration adds on which the rows at both
    ends agree; in the first and the last segment what it adds next to it.
    """
    D = _accelerations(spans, d)
    sizes = np.linalg.norm(D, axis=1)
    agree = np.einsum("ij,ij->i", D[:-1], D[1:]) > 0
    agreed = np.where(agree, np.minimum(sizes[:-1], sizes[1:]), 0.0)
    agreed = np.pad(agreed, 1, mode="edge") if len(agreed) else np.zeros(len(d))
    most: Array = STEEPEST * (np.linalg.norm(d, axis=1) + spans[:, 0] * agreed)
    return most


def _solved(before: Array, own: Array, after: Array, right: Array) -> Array:
    """Solve before_k v_k-1 + own_k v_k + after_k v_k+1 = right_k, with blocks (n, 3, 3)."""
    n, d = right.shape
    columns = d * np.arange(n)
    banded = np.zeros((4 * d - 1, n * d))
    for offset, blocks in ((-1, before), (0, own), (1, after)):
        rows = slice(max(0, -offset), n - max(0, offset))
        for i in range(d):
            for j in range(d):
                at = columns[rows] + offset * d + j
                banded[2 * d - 1 + i - j - offset * d, at] = blocks[rows, i, j]
    solved: Array = solve_banded((2 * d - 1, 2 * d - 1), banded, right.ravel()).reshape(n, d)
    return solved
