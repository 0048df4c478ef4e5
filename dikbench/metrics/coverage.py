"""How much of a path a motion covered, in its order, within a tolerance; and the tolerance needed.

The samples S_j of the path are covered one after the other: S_j at the first instant k, not before
that of S_(j-1) nor before the target is there, at which the segment [x_(k-1), x_k] of the motion
comes within the tolerance of S_j. Segments, so that a fast step misses no sample; the order, so
that a closed path is not covered by standing still.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.scenario.reference.embedded_path import EmbeddedPath

LARGEST_TOLERANCE_M: Final = 0.25
"""No larger tolerance is searched for: a motion that needs one has not done the path."""

SQUARE_ROUNDING_M2: Final = 1e-14
"""Rounding of square distances: a needed tolerance is exact to 5e-12 m at 1 mm, to 1e-7 m at 0."""

SAMPLES_TOGETHER: Final = 64
SEGMENTS_TOGETHER: Final = 48
"""The distances of so many samples from so many segments are computed at once to begin with ..."""

FEWEST_SEGMENTS_TOGETHER: Final = 16
MOST_SEGMENTS_TOGETHER: Final = 3072
"""... and then, as the motion is fast or slow, from fewer or more segments of more or fewer."""

DISTANCES_TOGETHER: Final = 32768
"""About so many distances of samples from all segments are computed at once."""

SAMPLES_PER_LOOK: Final = 24
"""So many samples are looked at together for a lower bound of the needed tolerance."""


class Coverage:
    """The ordered coverage of a path by a motion, for every tolerance.

    Args:
        path: whose samples are S_j, (f, d) [m] (see `Embedding`).
        points: of the motion, at the start and after each step, (n + 1, d) [m].
        targets: number of the sample that the target has come to at each instant, not decreasing,
            (n + 1,): no later one is covered yet.
        at_target: number of the instant at which the target is there, or of the last one, (f,);
            where a sample is expected to be covered.
        apart: how far the other frames of the task are from their own targets in each segment,
            (n + 1,) [m]; the largest of the distances counts.
    """

    def __init__(
        self,
        path: EmbeddedPath,
        points: Array,
        targets: Indices,
        at_target: Indices,
        apart: Array,
    ) -> None:
        count, ones = int(targets[-1]) + 1, np.ones(len(points))
        x = points - path.points[0]
        starts = np.concatenate([x[:1], x[:-1]])
        ways = x - starts
        self._lengths = np.sqrt(np.einsum("ij,ij->i", ways, ways))
        ways /= np.where(self._lengths > 0, self._lengths, 1.0)[:, None]
        along, squares = (np.einsum("ij,ij->i", starts, each) for each in (ways, starts))
        # |S - a|^2 and (S - a) . d are products of [S, 1, |S|^2] with these.
        self._samples = path.lifted[:count]
        self._away = np.column_stack([-2 * starts, squares, ones])
        self._along = np.column_stack([ways, -along, 0 * ones])
        self._apart_squares = apart**2 if apart.any() else None
        self._earliest = np.searchsorted(targets, np.arange(count))
        expected = np.maximum(at_target[:count], self._earliest)
        self._by_clock = np.array_equal(expected, self._earliest)
        self._at_target = self._squares(slice(None), expected, pairs=True)
        after = np.minimum(expected + 1, len(points) - 1)
        self._about_target = np.minimum(
            self._at_target, self._squares(slice(None), after, pairs=True)
        )
        self._rows: dict[int, Array] = {}

    def instants(self, tolerance: float) -> Indices:
        """Find the instants at which samples are covered at a tolerance [m], as far as they are."""
        found = np.empty(len(self._samples), dtype=int)
        last = len(found) - 1, len(self._lengths) - 1
        return found[: self._cover(found, 0, tolerance**2, *last)]

    def needed(self, wanted: Sequence[tuple[int, int]]) -> list[float]:
        """Find the smallest tolerances at which samples are covered by instants [m].

        Infinite where the target did not come to the sample by then, or the tolerance would be
        above `LARGEST_TOLERANCE_M`.

        What a few of the samples need, in their order, is a lower bound. It is the answer if all
        are covered at it; otherwise more are looked at, where one is not covered, or late.

        Args:
            wanted: the number of a sample and of an instant, for each.
        """
        found = [float("inf")] * len(wanted)
        order = sorted(
            (sample, until, number)
            for number, (sample, until) in enumerate(wanted)
            if sample < len(self._samples) and self._earliest[sample] <= until
        )
        self._look_at(self._farthest(max((sample for sample, _, _ in order), default=0)))
        self._look_at([sample for sample, _, _ in order])
        bounds = self._bounds(order)
        instants, covered, square, begun = np.empty(len(self._samples), dtype=int), 0, 0.0, 0.0
        for place, (sample, until, number) in enumerate(order):
            while bounds[place] <= LARGEST_TOLERANCE_M**2:
                if bounds[place] < square or (covered and instants[covered - 1] > until):
                    covered = 0
                square = bounds[place]
                begun = begun if covered else square
                enough = square + SQUARE_ROUNDING_M2
                covered = self._cover(instants, covered, enough, sample, until)
                if covered > sample:
                    found[number] = float(np.sqrt(square))
                    break
                self._look_around(covered)
                bounds = self._bounds(order)
                if bounds[place] > square:
                    continue
                if begun == square:  # else the first were covered at less, and later
                    for late in self._late(instants[:covered]):
                        self._look_around(late)
                        bounds = self._bounds(order)
                        if bounds[place] > square:
                            break
                    else:  # all were looked at: what keeps one from being covered is rounding
                        found[number] = float(np.sqrt(square))
                        break
                covered = 0
        return found

    def _farthest(self, last: int) -> list[int]:
        """Choose samples that are far from the motion when the target is there, all along it."""
        length = last // SAMPLES_PER_LOOK + 1
        far, starts = self._about_target, range(0, last, length)
        return [first + int(far[first : first + length].argmax()) for first in starts]

    def _late(self, instants: Indices) -> Iterator[int]:
        """Give the samples that were not looked at, those first that were waited for longest."""
        before = np.maximum(np.append(0, instants[:-1]), self._earliest[: len(instants)])
        for sample in np.argsort(before - instants, kind="stable").tolist():
            if sample not in self._rows:
                yield sample

    def _look_around(self, sample: int) -> None:
        """Look at a sample and at others between the two next to it that were."""
        known = sorted(self._rows)
        place = bisect_left(known, sample)
        first, last = known[max(place - 1, 0)], known[place]
        self._look_at([*range(first, last, (last - first) // SAMPLES_PER_LOOK + 1), sample])

    def _look_at(self, samples: Iterable[int]) -> None:
        """Compute the distances of samples from all segments."""
        new = sorted(set(samples) - self._rows.keys())
        together = DISTANCES_TOGETHER // len(self._lengths) + 1
        for first in range(0, len(new), together):
            part = new[first : first + together]
            self._rows.update(zip(part, self._squares(part, slice(None)), strict=True))

    def _bounds(self, order: Sequence[tuple[int, int, int]]) -> list[float]:
        """Compute at which square tolerances [m^2] the samples looked at are covered in time.

        With g_j(k) the smallest one at which sample j is covered by instant k,

            g_j(k) = min over k' <= k of max(g_(j-1)(k'), square distance of S_j from segment k')
        """
        bounds, needed = dict.fromkeys(order, 0.0), np.zeros(len(self._lengths))
        of_sample: dict[int, list[tuple[int, int, int]]] = {}
        for each in order:
            of_sample.setdefault(each[0], []).append(each)
        for sample in sorted(self._rows):
            possible = slice(self._earliest[sample], None)
            part = needed[possible]
            np.maximum(part, self._rows[sample][possible], out=part)
            np.minimum.accumulate(part, out=part)
            for each in of_sample.get(sample, ()):
                bounds[each] = float(needed[each[1]])
        return list(bounds.values())

    def _cover(
        self, instants: Indices, covered: int, square: float, sample: int, until: int
    ) -> int:
        """Cover samples in turn until one is, or none can be by an instant, at a square tolerance.

        Args:
            instants: those at which samples are covered; the next are written into it.
            covered: how many are.
            square: the tolerance [m^2].
            sample: the last sample.
            until: the last instant.

        Returns:
            How many are covered then.
        """
        if self._by_clock and not covered:
            far = (self._at_target > square) | (self._earliest > until)
            covered = min(int(far.argmax()) if far.any() else len(far), sample + 1)
            instants[:covered] = self._earliest[:covered]
        now, together = int(instants[covered - 1]) if covered else 0, SEGMENTS_TOGETHER
        while covered <= sample:
            now = max(now, int(self._earliest[covered]))
            if now > until:
                break
            height = max(SAMPLES_TOGETHER * SEGMENTS_TOGETHER // together, 1)
            rows = slice(covered, min(covered + height, sample + 1))
            segments = slice(now, min(now + together, until + 1))
            near = self._squares(rows, segments) <= square
            near &= np.arange(now, segments.stop) >= self._earliest[rows, None]
            # The first that is near and not before that of the sample before, if that is near.
            first = np.maximum.accumulate(near.argmax(axis=1))
            far = ~near[np.arange(len(near)), first]
            count = int(far.argmax()) if far.any() else len(far)
            instants[covered : covered + count] = first[:count] + now
            covered += count
            now = int(instants[covered - 1]) if count else segments.stop
            if 2 * count < len(near):
                together = min(2 * together, MOST_SEGMENTS_TOGETHER)
            elif 2 * (now - segments.start) < together:
                together = max(together // 2, FEWEST_SEGMENTS_TOGETHER)
        return covered

    def _squares(self, samples: Any, segments: Any, pairs: bool = False) -> Array:
        """Compute square distances [m^2] of samples from segments, (samples, segments) or pairs."""
        S, lengths = self._samples[samples], self._lengths[segments]
        squares: Array
        squares, along = (
            np.einsum("ij,ij->i", S, each.take(segments, axis=0)) if pairs else S @ each[segments].T
            for each in (self._away, self._along)
        )
        share = np.minimum(np.maximum(along, 0.0), lengths)
        along *= 2
        along -= share
        along *= share
        squares -= along
        if self._apart_squares is not None:
            np.maximum(squares, self._apart_squares[segments], out=squares)
        return squares
