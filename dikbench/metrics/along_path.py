"""Where on a path a frame is that follows it: the nearest point, without jumps to other laps."""

from __future__ import annotations

from math import sqrt
from typing import Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.path import Path

AHEAD: Final = 0.02
"""The nearest point is looked for so far ahead along the path [m]."""

NEARER: Final = 1e-3
"""It goes on farther only where that is nearer by more than this [m] and half a piece."""

LOOKS: Final = 256
"""At so many instants of a run, about, the whole way up to the target is looked through."""


def follow_path(path: Path, points: Array, targets: Array) -> Array:
    """How far along a path the points of a motion have come.

    The nearest point of the path among those from where the motion was before to where the target
    is: it never goes back, nor ahead of the target. Farther ahead than `AHEAD` it goes only where
    that is nearer by more than `NEARER` (a corner that was cut, a way back that began too early),
    so that a frame that rests, or lags, at a crossing of the path is not taken to be a lap ahead.

    Args:
        path: a path that is not a point.
        points: of the motion, (n, 3) [m].
        targets: length of the way to its target at each, not decreasing, (n,) [m].

    Returns:
        Length of the way to the nearest point, not decreasing, (n,) [m].
    """
    looks = np.unique(
        np.append(np.arange(0, len(points), len(points) // LOOKS + 1), len(points) - 1)
    )
    arcs = path.vertex_arcs
    rough = arcs[_vertices(path, points[looks], targets[looks])]
    start = np.interp(np.arange(len(points)), looks, rough)
    pieces = np.clip(np.searchsorted(arcs, start, side="right") - 1, 0, len(path.pieces) - 1)
    found = np.minimum(_descend(path, points, pieces), targets)
    along: Array = np.maximum.accumulate(found)
    return along


def _vertices(path: Path, points: Array, targets: Array) -> list[int]:
    """The vertex of the path nearest to each point, by the rules of `follow_path`."""
    middle = path.vertices.mean(axis=0)
    V, P = path.vertices - middle, points - middle
    # |V - p|^2 = [|V|^2, -2 V] [1, p] + |p|^2
    Q = np.column_stack([np.einsum("ij,ij->i", V, V), -2 * V])
    asked = np.column_stack([np.ones(len(P)), P])
    sizes = np.einsum("ij,ij->i", P, P).tolist()
    ends = (np.searchsorted(path.vertex_arcs, targets) + 1).tolist()
    reach = np.searchsorted(path.vertex_arcs, path.vertex_arcs + AHEAD, side="right").tolist()
    nearer = NEARER + float(np.diff(path.vertex_arcs).max()) / 2
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


def _descend(path: Path, points: Array, pieces: Indices) -> Array:
    """Length of the way [m] to the foot of each point, going from piece to piece while nearer."""
    last = len(path.pieces) - 1
    arcs, open_ = np.empty(len(points)), np.arange(len(points))
    lengths = np.diff(path.vertex_arcs)
    while len(open_):
        here = pieces[open_]
        choice = np.clip(here + np.array([[0], [-1], [1]]), 0, last)  # the piece itself wins a tie
        shares, squares = path.feet(points[open_], choice)
        best, each = squares.argmin(axis=0), np.arange(len(open_))
        chosen = choice[best, each]
        arcs[open_] = path.vertex_arcs[chosen] + shares[best, each] * lengths[chosen]
        pieces[open_] = chosen
        open_ = open_[chosen != here]
    return arcs
