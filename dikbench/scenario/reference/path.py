"""The path of a reference: the curve of its origin as a chain of straight pieces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.reference import Reference

CHORD_ERROR_M: Final = 1e-6
"""Approximate largest distance of a straight piece from the curve."""

LONGEST_PIECE_M: Final = 5e-3
"""Largest length up to which pieces are joined where the path is straight enough."""

MAX_SAMPLES_PER_PERIOD: Final = 16
"""A control period is divided into at most this many samples."""

NEGLIGIBLE_LENGTH_M: Final = 1e-9
"""A shorter path, or step along it, counts as a point."""

FIRST_NEIGHBOUR_COUNT: Final = 4
"""Number of nearest vertices that are searched first: two ways that meet have two each."""

POINTS_TOGETHER: Final = 128
"""Feet of so many points are computed at once: the arrays of more do not stay in the cache."""


@dataclass(frozen=True, eq=False)
class ReferencePath:
    """The path of a reference's origin from the first nominal time to the last.

    Attributes:
        vertices: ends of the straight pieces, (k + 1, 3) [m].
        once: number of pieces of the path as a set; a periodic path repeats these.
    """

    vertices: Array
    once: int

    @property
    def is_point(self) -> bool:
        """Whether the origin of the reference does not move."""
        return len(self.vertices) == 1

    @cached_property
    def pieces(self) -> Array:
        """Vectors from each vertex to the next, (k, 3) [m]."""
        return np.diff(self.vertices, axis=0)

    @cached_property
    def squares(self) -> Array:
        """Square lengths of the pieces, (k,) [m^2]."""
        lengths: Array = np.einsum("ij,ij->i", self.pieces, self.pieces)
        return lengths

    def distances(self, points: Array) -> Array:
        """Compute distances of points (n, 3) [m] from the path as a set, (n,) [m], to 1e-6 m."""
        if self.is_point:
            away: Array = np.linalg.norm(points - self.vertices[0], axis=1)
            return away
        tree, most = self._tree
        squares, open_ = np.full(len(points), np.inf), np.arange(len(points))
        asked, count = np.column_stack([points, np.zeros(len(points))]), FIRST_NEIGHBOUR_COUNT
        while len(open_):
            count = min(count, tree.n)
            away, ends = tree.query(asked[open_], count)
            away, ends = away.reshape(-1, count), ends.reshape(-1, count)
            pieces = np.hstack([np.maximum(ends - 1, 0), np.minimum(ends, self.once - 1)])
            found = feet(points[open_], pieces, self.vertices, self.pieces, self.squares)[1]
            squares[open_] = np.minimum(squares[open_], found.min(axis=1))
            if count == tree.n:
                break
            # No piece of another vertex is nearer than this.
            open_ = open_[squares[open_] > away[:, -1] ** 2 - most]
            count *= 4
        distances: Array = np.sqrt(squares)
        return distances

    @cached_property
    def _tree(self) -> tuple[Any, float]:
        """The vertices of the path as a set; see `vertex_tree`."""
        vertices = self.vertices[: self.once + 1]
        return vertex_tree(vertices, self.squares[: self.once])


def vertex_tree(vertices: Array, squares: Array) -> tuple[Any, float]:
    """Make a tree in which pieces are no nearer than their ends, whatever the pieces' lengths.

    It is of the vertices with another coordinate, so that square distances less a constant are
    those that the two pieces at a vertex have at least, |x - vertex|^2 - (length / 2)^2.

    Args:
        vertices: of a chain of pieces, (k + 1, d) [m].
        squares: square lengths of the pieces, (k,) [m^2].

    Returns:
        The tree, (d + 1) coordinates each, and the constant [m^2].
    """
    halves = squares / 4
    halves = np.maximum(np.append(halves, 0.0), np.append(0.0, halves))
    most = float(halves.max())
    return cKDTree(np.column_stack([vertices, np.sqrt(most - halves)])), most


def feet(
    points: Array, pieces: Indices, starts: Array, ways: Array, squares: Array
) -> tuple[Array, Array]:
    """Compute each point's nearest points of pieces: shares of their lengths, square distances.

    Args:
        points: (n, d) [m].
        pieces: the numbers of k pieces for each, (n, k).
        starts: of all pieces, (f, d) [m].
        ways: from their starts to their ends, (f, d) [m].
        squares: square lengths of all, (f,) [m^2].

    Returns:
        Two arrays (n, k): 0 at the piece's start to 1 at its end, and [m^2].
    """
    shares, found = np.empty(pieces.shape), np.empty(pieces.shape)
    for first in range(0, len(points), POINTS_TOGETHER):
        part = slice(first, first + POINTS_TOGETHER)
        asked = pieces[part].ravel()
        away, along = np.repeat(points[part], pieces.shape[1], axis=0), ways.take(asked, axis=0)
        away -= starts.take(asked, axis=0)
        share = np.einsum("ij,ij->i", away, along)
        share /= np.maximum(squares.take(asked), np.finfo(float).tiny)
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        along *= share[:, None]
        away -= along
        shares[part] = share.reshape(-1, pieces.shape[1])
        found[part] = np.einsum("ij,ij->i", away, away).reshape(-1, pieces.shape[1])
    return shares, found


def reference_path(reference: Reference, dt: float) -> ReferencePath:
    """Compute the path of a moving reference, sampled at dt [s] or finer.

    Pieces are as long as `CHORD_ERROR_M` and `LONGEST_PIECE_M` allow.
    """
    times, points = _samples(reference, dt)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    arcs = np.concatenate([[0.0], np.cumsum(steps)])
    kept = _simplified(points, steps, arcs)
    lap = np.interp(reference.first_lap + reference.period, times, arcs)
    once = max(1, min(int(np.searchsorted(arcs[kept], lap)), len(kept) - 1))
    return ReferencePath(points[kept], once)


def _samples(reference: Reference, dt: float) -> tuple[Array, Array]:
    """Sample times (f,) [s] and points (f, 3) [m], so that chords are within `CHORD_ERROR_M`."""
    end = reference.duration

    times = np.linspace(0.0, end, max(2, int(np.ceil(end / dt))) + 1)
    points = reference.placements(times)[1]
    bends = np.linalg.norm(np.diff(points, 2, axis=0), axis=1) / 8  # how far the chord is off
    worst = np.maximum(np.append(bends, 0.0), np.insert(bends, 0, 0.0))
    parts = np.clip(np.ceil(np.sqrt(worst / CHORD_ERROR_M)), 1, MAX_SAMPLES_PER_PERIOD).astype(int)
    first = np.cumsum(parts) - parts
    share = (np.arange(parts.sum()) - np.repeat(first, parts)) / np.repeat(parts, parts)
    finer = np.append(np.repeat(times[:-1], parts) + share * (times[1] - times[0]), end)
    filled = np.empty((len(finer), 3))
    known = np.append(share == 0, True)
    filled[known] = points
    filled[~known] = reference.placements(finer[~known])[1]
    return finer, filled


def _simplified(points: Array, steps: Array, arcs: Array) -> Indices:
    """Choose the samples that stay vertices: the first, the last, and those needed between."""
    moved = np.concatenate([[0], np.flatnonzero(steps > NEGLIGIBLE_LENGTH_M) + 1])
    if len(moved) == 1:
        return moved
    directions = np.diff(points[moved], axis=0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    turns = [*np.linalg.norm(np.diff(directions, axis=0), axis=1).tolist(), 0.0]
    lengths = arcs[moved].tolist()
    kept, turned = [0], 0.0
    for k in range(1, len(moved) - 1):
        turned += turns[k - 1]
        length = lengths[k + 1] - lengths[kept[-1]]
        if length > LONGEST_PIECE_M or length * turned > 8 * CHORD_ERROR_M:
            kept.append(k)
            turned = 0.0
    return moved[[*kept, len(moved) - 1]]
