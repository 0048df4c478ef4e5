"""The path of a reference in position and orientation: straight pieces between its samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.problem.embedding import Embedding
from dikbench.scenario.reference.path import feet, vertex_tree
from dikbench.scenario.reference.reference import Reference

SAMPLES_PER_PERIOD: Final = 4
"""Number of samples of the path in a control period ..."""

FEWEST_SAMPLES: Final = 200
"""... but at least so many from end to end ..."""

MOST_SAMPLES: Final = 8000
"""... and at most so many."""

SAME_INSTANT_S: Final = 1e-9
"""Nominal times that differ by less than this are one."""

NEGLIGIBLE_PIECE_M: Final = 1e-9
"""Length up to which a piece counts as a point."""

TIE_M: Final = 1e-5
"""Difference of two distances up to which points of the path are equally near.

At 1e-9 a formulation whose effective gain is below 1 creeps into every end of a minimum-jerk
motion: `dls[damping=0.05]` took 2.63 of the nominal duration of `pick-and-place`, at 1e-5 it takes
1.22; exact motions and those held to a share of the speed take as long at either.
"""

SAME_DISTANCE_M2: Final = 1e-18
"""Difference of two square distances up to which they are one."""

FIRST_NEIGHBOUR_COUNT: Final = 3
"""Number of nearest samples that are searched first."""


@dataclass(frozen=True, eq=False)
class EmbeddedPath:
    """The samples S_j of a path from the first nominal time to the last, and the pieces between.

    Attributes:
        times: nominal times t(S_j), increasing, (f,) [s].
        points: S_j, (f, d) [m] (see `Embedding`).
        arcs: path length to them, (f,) [m].
        once: number of the first pieces that hold the path as a set; those of a periodic one repeat
            them.
    """

    times: Array
    points: Array
    arcs: Array
    once: int

    @cached_property
    def pieces(self) -> Array:
        """Vectors from each sample to the next, (f - 1, d) [m]."""
        return np.diff(self.points, axis=0)

    @cached_property
    def squares(self) -> Array:
        """Square lengths of the pieces, (f - 1,) [m^2]."""
        squares: Array = np.einsum("ij,ij->i", self.pieces, self.pieces)
        return squares

    @cached_property
    def extent(self) -> float:
        """Largest distance of a sample from the first one [m]."""
        return float(np.linalg.norm(self.points - self.points[0], axis=1).max())

    @cached_property
    def lifted(self) -> Array:
        """The samples from the first one on, [S, 1, |S|^2], (f, d + 2) [m].

        Products with these are square distances (see `Coverage`).
        """
        S = self.points - self.points[0]
        return np.column_stack([S, np.ones(len(S)), np.einsum("ij,ij->i", S, S)])

    def last_until(self, times: Any) -> Any:
        """Find the last sample whose nominal time is not after these [s]: its number."""
        return np.searchsorted(self.times, np.asarray(times) + SAME_INSTANT_S, side="right") - 1

    def at(self, times: Array) -> Array:
        """Compute the path's points at nominal times (n,) [s], (n, d) [m]; its ends outside."""
        pieces = np.searchsorted(self.times, times, side="right") - 1
        pieces = np.clip(pieces, 0, len(self.pieces) - 1)
        share = (times - self.times[pieces]) / (self.times[pieces + 1] - self.times[pieces])
        share = np.clip(share, 0.0, 1.0)
        points: Array = self.points[pieces] + share[:, None] * self.pieces[pieces]
        return points

    def nearest(self, points: Array) -> tuple[Array, Indices, Array]:
        """Find the nearest points of the path as a set; of equally near ones the first.

        Args:
            points: (n, d) [m].

        Returns:
            Distances (n,) [m], the pieces that they are on (n,), and the shares of those (n,).
        """
        tree, most, long = self._tree
        squares, shares = np.full((2, len(points)), np.inf)
        nearest, open_ = np.zeros(len(points), dtype=int), np.arange(len(points))
        asked, count = np.column_stack([points, np.zeros(len(points))]), FIRST_NEIGHBOUR_COUNT
        while len(open_):
            count = min(count, tree.n)
            away, ends = tree.query(asked[open_], count)
            away, ends = away.reshape(-1, count), ends.reshape(-1, count)
            pieces = long[np.hstack([np.maximum(ends - 1, 0), np.minimum(ends, len(long) - 1)])]
            pieces.sort(axis=1)
            share, square = feet(points[open_], pieces, self.points, self.pieces, self.squares)
            squares[open_] = square.min(axis=1)
            best = (square <= squares[open_, None] + SAME_DISTANCE_M2).argmax(axis=1)[:, None]
            nearest[open_] = np.take_along_axis(pieces, best, axis=1)[:, 0]
            shares[open_] = np.take_along_axis(share, best, axis=1)[:, 0]
            if count == tree.n:
                break
            open_ = open_[squares[open_] >= away[:, -1] ** 2 - most]
            count *= 3
        return np.sqrt(squares), nearest, shares

    @cached_property
    def _tree(self) -> tuple[Any, float, Indices]:
        """The ends of the pieces that make up the path as a set, but for those without length.

        The tree of the ends, the number i that of piece i - 1 and the start of piece i, and its
        constant (see `vertex_tree`); and the numbers of the pieces, (b,).
        """
        long = np.flatnonzero(self.squares[: self.once] > 0)
        if not len(long):
            long = np.zeros(1, dtype=int)
        ends = self.points[np.append(long, long[-1] + 1)]
        return *vertex_tree(ends, self.squares[long]), long

    def latest_nearest(self, point: Array, first: float, last: float) -> float:
        """Find the nominal time of the nearest point of a part of the path [s].

        Of points that are equally near, within `TIE_M`, the latest counts.

        Args:
            point: (d,) [m].
            first: nominal time at which the part begins [s].
            last: nominal time at which it ends, later [s].
        """
        times = self.times
        end = min(int(times.searchsorted(last)), len(times) - 1)
        start = min(max(int(times.searchsorted(first, side="right")) - 1, 0), end - 1)
        along, away = self.pieces[start:end], point - self.points[start:end]
        scale, offset = self.to_shares
        share = np.einsum("ij,ij->i", away, along) * scale[start:end] + offset[start:end]
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        share[0] = max(share[0], (first - times[start]) / (times[start + 1] - times[start]))
        share[-1] = min(share[-1], (last - times[end - 1]) / (times[end] - times[end - 1]))
        away -= share[:, None] * along
        squares = np.einsum("ij,ij->i", away, away)
        near = squares <= (sqrt(squares.min()) + TIE_M) ** 2
        latest = end - 1 - int(near[::-1].argmax())
        return float(times[latest] + share[latest - start] * (times[latest + 1] - times[latest]))

    @cached_property
    def to_shares(self) -> tuple[Array, Array]:
        """The factor and the summand that make shares of products with the pieces, (f - 1,) each.

        The foot on a piece without length is its end.
        """
        resting = self.squares <= NEGLIGIBLE_PIECE_M**2
        scale: Array = np.where(resting, 0.0, 1 / np.where(resting, 1.0, self.squares))
        return scale, resting.astype(float)

    @cached_property
    def _directions(self) -> Array:
        """Unit vectors along the pieces, (f - 1, d); 0 where one has no length."""
        lengths = np.sqrt(self.squares)
        return self.pieces / np.where(lengths > NEGLIGIBLE_PIECE_M, lengths, np.inf)[:, None]

    def tangents(self, pieces: Indices, shares: Array) -> Array:
        """Interpolate the unit tangent at points of pieces, linearly between their middles.

        Args:
            pieces: the number of a piece for each point, (n,).
            shares: of its length, (n,).

        Returns:
            (n, d); 0 on a piece without length. Where the path turns back it is one of the two.
        """
        directions = self._directions
        other = np.clip(pieces + np.where(shares < 0.5, -1, 1), 0, len(directions) - 1)
        own, next_ = directions.take(pieces, axis=0), directions.take(other, axis=0)
        part = np.abs(shares - 0.5)[:, None]
        # Towards a piece that rests, or that turns back, there is nothing to interpolate.
        bends = np.einsum("ij,ij->i", own, next_)[:, None] > 0
        mixed = np.where(bends, (1 - part) * own + part * next_, own)
        sizes = np.linalg.norm(mixed, axis=1, keepdims=True)
        tangents: Array = mixed / np.where(sizes > 0, sizes, 1.0)
        return tangents


def embedded_path(reference: Reference, embedding: Embedding, dt: float) -> EmbeddedPath:
    """Sample the path of a moving reference.

    Args:
        reference: the reference.
        embedding: of its task.
        dt: control period [s].
    """
    end = reference.duration
    count = int(np.clip(SAMPLES_PER_PERIOD * round(end / dt), FEWEST_SAMPLES, MOST_SAMPLES))
    times = np.linspace(0.0, end, count + 1)
    points = embedding.points(*reference.placements(times))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    lap = reference.first_lap + reference.period
    once = min(int(np.searchsorted(times, lap - SAME_INSTANT_S)), len(times) - 1)
    return EmbeddedPath(times, points, np.append(0.0, np.cumsum(steps)), once)
