"""Paths of many references, of which the nearest points are searched at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.embedded_path import TIE_M, EmbeddedPath


class ManyPaths:
    """N paths with points of one dimension; a row's result does not depend on the others.

    Args:
        paths: the paths.
        longest: the longest part that is searched [s].
    """

    def __init__(self, paths: Sequence[EmbeddedPath], longest: float) -> None:
        self._counts = np.array([len(path.times) for path in paths])
        self._firsts = np.cumsum(self._counts) - self._counts
        self._times = np.concatenate([path.times for path in paths])
        self._periods = np.array([path.times[1] - path.times[0] for path in paths])
        shares = [path.to_shares for path in paths]
        # A piece for each sample, so that both are found by one number; the last leads nowhere.
        none = np.zeros((1, paths[0].points.shape[1]))
        points = np.concatenate([path.points for path in paths])
        pieces = np.concatenate([np.vstack([path.pieces, none]) for path in paths])
        scale = np.concatenate([np.append(scale, 0.0) for scale, _ in shares])
        offset = np.concatenate([np.append(offset, 0.0) for _, offset in shares])
        self._width = int(np.ceil(longest / self._periods.min())) + 3
        self._points, self._pieces = (_windows(each, self._width) for each in (points, pieces))
        self._scale, self._offset = (_windows(each, self._width) for each in (scale, offset))

    def latest_nearest(self, rows: Indices, points: Array, first: Array, last: Array) -> Array:
        """Find nominal times of the nearest points of parts (see `EmbeddedPath.latest_nearest`).

        Args:
            rows: the numbers of some of the paths, (n,).
            points: (n, d) [m].
            first: nominal times at which the parts begin, (n,) [s].
            last: nominal times at which they end, later, (n,) [s].

        Returns:
            (n,) [s].
        """
        most = self._counts[rows] - 1
        end = np.minimum(self._first_from(rows, last), most)
        start = np.clip(self._first_after(rows, first) - 1, 0, end - 1)
        at = self._firsts[rows] + start
        width = int((end - start).max())
        along = self._pieces[at, :width]
        away = points[:, None] - self._points[at, :width]
        share = np.einsum("nwd,nwd->nw", away, along)
        share *= self._scale[at, :width]
        share += self._offset[at, :width]
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
        number, pieces = np.arange(len(rows)), np.arange(width)
        ends = end - start - 1
        share[:, 0] = np.maximum(share[:, 0], self._share_of(at, first))
        share[number, ends] = np.minimum(share[number, ends], self._share_of(at + ends, last))
        away -= share[..., None] * along
        squares = np.einsum("nwd,nwd->nw", away, away)
        squares[pieces > ends[:, None]] = np.inf
        near = squares <= ((np.sqrt(squares.min(axis=1)) + TIE_M) ** 2)[:, None]
        latest = width - 1 - near[:, ::-1].argmax(axis=1)
        begin = self._times[at + latest]
        times: Array = begin + share[number, latest] * (self._times[at + latest + 1] - begin)
        return times

    def _share_of(self, at: Indices, times: Array) -> Array:
        """Compute the shares of pieces at which nominal times are, (n,)."""
        begin = self._times[at]
        share: Array = (times - begin) / (self._times[at + 1] - begin)
        return share

    def _first_from(self, rows: Indices, times: Array) -> Indices:
        """Find the first sample of each path that is not before a time, (n,)."""
        return self._moved_to(rows, times, np.less)

    def _first_after(self, rows: Indices, times: Array) -> Indices:
        """Find the first sample of each path after a time, (n,)."""
        return self._moved_to(rows, times, np.less_equal)

    def _moved_to(self, rows: Indices, times: Array, before: np.ufunc) -> Indices:
        """Find the first sample that is not before a time: samples are equally spaced.

        The quotient is off by rounding, by one at most: the samples about it decide.
        """
        count, firsts = self._counts[rows], self._firsts[rows]
        guess = np.clip((times / self._periods[rows]).astype(int) - 1, 0, count)
        for _ in range(3):
            sample = self._times[firsts + np.minimum(guess, count - 1)]
            guess = guess + ((guess < count) & before(sample, times))
        found: Indices = guess
        return found


def _windows(values: Array, width: int) -> Array:
    """Return what begins at each of values (f, ...) and is so many long, (f, width, ...)."""
    padded = np.concatenate([values, np.zeros((width, *values.shape[1:]))])
    strides = (padded.strides[0], *padded.strides)
    windows: Array = np.lib.stride_tricks.as_strided(
        padded, (len(values), width, *values.shape[1:]), strides, writeable=False
    )
    return windows
