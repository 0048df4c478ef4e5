"""The position of a frame along a path: the nearest point, without jumps to other laps."""

from __future__ import annotations

from math import sqrt
from typing import Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.path import ReferencePath

SEARCH_AHEAD_M: Final = 0.02
"""Path length ahead within which the nearest point is searched."""

MIN_GAIN_FARTHER_AHEAD_M: Final = 1e-3
"""A point farther ahead must be nearer by more than this and half a piece."""

COARSE_SEARCH_INSTANTS: Final = 256
"""Approximate number of instants at which the whole path up to the target is searched."""


def follow_path(path: ReferencePath, points: Array, targets: Array) -> Array:
    """Compute how far along a path the points of a motion are.

    Each is at the nearest point of the path between where the motion was before and where the
    target is: it never goes back, nor ahead of the target. It goes farther ahead than
    `SEARCH_AHEAD_M` only if it is nearer there by more than `MIN_GAIN_FARTHER_AHEAD_M` (a corner
    that was cut, a return that began too early), so that a frame that rests, or lags, at a crossing
    of the path is not taken to be a lap ahead.

    Args:
        path: a path that is not a point.
        points: of the motion, (n, 3) [m].
        targets: path length to the target of each, not decreasing, (n,) [m].

    Returns:
        Path length to the nearest point, not decreasing, (n,) [m].
    """
    stride = len(points) // COARSE_SEARCH_INSTANTS + 1
    coarse = np.unique(np.append(np.arange(0, len(points), stride), len(points) - 1))
    arcs = path.vertex_arcs
    rough = arcs[_vertices(path, points[coarse], targets[coarse])]
    start = np.interp(np.arange(len(points)), coarse, rough)
    pieces = np.clip(np.searchsorted(arcs, start, side="right") - 1, 0, len(path.pieces) - 1)
    found = np.minimum(_descend(path, points, pieces), targets)
    along: Array = np.maximum.accumulate(found)
    return along


def _vertices(path: ReferencePath, points: Array, targets: Array) -> list[int]:
    """Find the vertex of the path nearest to each point, by the rules of `follow_path`."""
    middle = path.vertices.mean(axis=0)
    V, P = path.vertices - middle, points - middle
    # |V - p|^2 = [|V|^2, -2 V] [1, p] + |p|^2
    Q = np.column_stack([np.einsum("ij,ij->i", V, V), -2 * V])
    asked = np.column_stack([np.ones(len(P)), P])
    sizes = np.einsum("ij,ij->i", P, P).tolist()
    arcs = path.vertex_arcs
    ends = (np.searchsorted(arcs, targets) + 1).tolist()
    reach = np.searchsorted(arcs, arcs + SEARCH_AHEAD_M, side="right").tolist()
    nearer = MIN_GAIN_FARTHER_AHEAD_M + float(np.diff(arcs).max()) / 2
    here, found = 0, []
    for p, size, end in zip(asked, sizes, ends, strict=True):
        squares = Q[here : max(end, here + 1)] @ p
        best = int(squares.argmin())
        if best >= reach[here] - here:
            close = int(squares[: reach[here] - here].argmin())
            near, far = (sqrt(max(float(squares[k]) + size, 0.0)) for k in (close, best))
            if not far + nearer < near:
                best = close
        here += best
        found.append(here)
    return found


def _descend(path: ReferencePath, points: Array, pieces: Indices) -> Array:
    """Compute the path length [m] to the foot of each point, from piece to piece while nearer."""
    last = len(path.pieces) - 1
    arcs, unsettled = np.empty(len(points)), np.arange(len(points))
    lengths = np.diff(path.vertex_arcs)
    while len(unsettled):
        here = pieces[unsettled]
        choice = np.clip(here + np.array([[0], [-1], [1]]), 0, last)  # the piece itself wins a tie
        shares, squares = path.feet(points[unsettled], choice)
        best, each = squares.argmin(axis=0), np.arange(len(unsettled))
        chosen = choice[best, each]
        arcs[unsettled] = path.vertex_arcs[chosen] + shares[best, each] * lengths[chosen]
        pieces[unsettled] = chosen
        unsettled = unsettled[chosen != here]
    return arcs
