"""How much of a path a motion covered, in its order, within a tolerance; and the tolerance needed.

The samples S_j of the path are covered one after the other: S_j at the first instant k, not before
that of S_(j-1) nor before the target is there, at which the segment [x_(k-1), x_k] of the motion
comes within the tolerance of S_j. Segments, so that a fast step misses no sample; the order, so
that a closed path is not covered by standing still.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np
from scipy.spatial.distance import cdist

from dikbench.arrays import Array, Indices

INF: Final = float("inf")

SAMPLES_PER_BLOCK: Final = 32
"""Distances are computed for this many samples at a time."""

LARGEST_TOLERANCE_M: Final = 0.25
"""No larger tolerance is searched for: a motion that needs one has not done the path."""

ROUNDING_M: Final = 1e-7
"""The distances that decide which others are computed are exact to this."""

INSTANTS_PER_BLOCK: Final = 8
"""Of so many instants it is asked together whether they come near a block of samples."""

CLOSE_M: Final = 0.02
"""If each sample is so near when the target is there, no other bound of the tolerance is sought."""


class Coverage:
    """The ordered coverage of a path by a motion, for every tolerance up to `LARGEST_TOLERANCE_M`.

    Args:
        samples: S_j, (f, d) [m] (see `Embedding`).
        points: of the motion, at the start and after each step, (n + 1, d) [m].
        targets: number of the sample that the target has come to at each instant, not decreasing,
            (n + 1,): no later one is covered yet.
        at_target: number of the instant at which the target is there, or of the last one, (f,).
        apart: how far the other frames of the task are from their own targets in each segment,
            (n + 1,) [m]; the largest of the distances counts.
        radius: tolerance up to which distances are computed to begin with [m].
    """

    def __init__(
        self,
        samples: Array,
        points: Array,
        targets: Indices,
        at_target: Indices,
        apart: Array,
        radius: float,
    ) -> None:
        count = int(targets[-1]) + 1
        starts = np.concatenate([points[:1], points[:-1]])
        self._samples, self._starts, self._ways = samples[:count], starts, points - starts
        self._way_squares = np.einsum("ij,ij->i", self._ways, self._ways)
        self._apart, self._radius = apart, radius
        self._earliest = np.searchsorted(targets, np.arange(count))
        self._at_target = np.maximum(at_target[:count], self._earliest)
        self._last_of_blocks = np.append(
            np.arange(SAMPLES_PER_BLOCK - 1, count - 1, SAMPLES_PER_BLOCK), count - 1
        )

    def instants(self, tolerance: float) -> list[int]:
        """Find the instants at which samples are covered at a tolerance [m], as far as they are."""
        self._search_within(tolerance)
        covered: list[int] = []
        now = 0
        for near, distances in self._blocks:
            hits, width = (distances <= tolerance).tobytes(), len(near)
            place = bisect_left(near, now)
            for row in range(0, len(hits), max(width, 1)):
                found = hits.find(1, row + place, row + width)
                if found < 0:
                    return covered
                place = found - row
                covered.append(near[place])
            if not width:
                break
            now = covered[-1]
        return covered

    def needed(self, wanted: Sequence[tuple[int, int]]) -> list[float]:
        """Find the smallest tolerances at which samples are covered by instants [m].

        Infinite where the target did not come to the sample by then, or the tolerance would be
        above `LARGEST_TOLERANCE_M`.

        Args:
            wanted: the number of a sample and of an instant, for each.
        """
        found = [INF] * len(wanted)
        possible = {
            number: (sample, until)
            for number, (sample, until) in enumerate(wanted)
            if sample < len(self._samples) and self._earliest[sample] <= until
        }
        enough = [min(self._enough(*each), LARGEST_TOLERANCE_M) for each in possible.values()]
        self._search_within(max(enough, default=0.0))
        last = max((sample for sample, _ in possible.values()), default=-1)
        asked = {sample for sample, _ in possible.values()}
        known, needed, sample = [0], np.zeros(1), -1
        for near, distances in self._blocks:
            if sample == last or not near:
                break
            # By an instant between two that come near, what the one before allows is needed.
            before = np.searchsorted(known, near, side="right") - 1
            needed = np.where(before < 0, INF, needed[before])
            known = near
            for row in distances:
                np.maximum(needed, row, out=needed)
                np.minimum.accumulate(needed, out=needed)
                sample += 1
                if sample in asked:
                    for number, (other, until) in possible.items():
                        place = bisect_left(known, until + 1) - 1
                        if other == sample and place >= 0:
                            found[number] = float(needed[place])
        return [value if value <= LARGEST_TOLERANCE_M else INF for value in found]

    def _enough(self, sample: int, until: int) -> float:
        """Compute a tolerance that is enough for a sample to be covered by an instant [m].

        With g_j(k) the smallest one at which sample j is covered by instant k,

            g_j(k) = min over k' <= k of max(g_(j-1)(k'), distance of S_j from segment k')

        over the last samples of blocks and this one, plus how far the others are from these. Where
        the motion is near when the target is there, that is enough.
        """
        together = self._needed_at_target
        if self._at_target[sample] <= until and together[sample] <= CLOSE_M:
            return float(together[sample])
        before = int(np.searchsorted(self._last_of_blocks, sample))
        rows = [self._needed_at_blocks[before - 1]] if before else []
        row = self._distances(np.array([sample]), np.arange(len(self._starts)))[0]
        row[: self._earliest[sample]] = np.inf
        largest = np.max([*rows, row], axis=0)
        return float(largest[: until + 1].min()) + 2 * float(self._reaches.max())

    @cached_property
    def _needed_at_target(self) -> Array:
        """The tolerance at which each sample is covered when the target is there, (count,) [m]."""
        k = self._at_target
        away, d, squares = self._samples - self._starts[k], self._ways[k], self._way_squares[k]
        share = np.einsum("ij,ij->i", away, d) / np.where(squares > 0, squares, 1.0)
        away -= np.clip(share, 0.0, 1.0)[:, None] * d
        distances = np.sqrt(np.einsum("ij,ij->i", away, away))
        needed: Array = np.maximum.accumulate(np.maximum(distances, self._apart[k]))
        return needed + ROUNDING_M

    @cached_property
    def _needed_at_blocks(self) -> Array:
        """The smallest tolerances g_j(k) of the last samples of blocks alone, (blocks, n + 1)."""
        needed = np.empty_like(self._from_blocks)
        before = np.zeros(needed.shape[1])
        for sample, row, out in zip(self._last_of_blocks, self._from_blocks, needed, strict=True):
            np.maximum(before, row, out=out)
            out[: self._earliest[sample]] = np.inf
            before = np.minimum.accumulate(out, out=out)
        return needed

    @cached_property
    def _from_blocks(self) -> Array:
        """The distances of the last samples of blocks from every segment, (blocks, n + 1) [m]."""
        return self._distances(self._last_of_blocks, np.arange(len(self._starts)))

    @cached_property
    def _reaches(self) -> Array:
        """The largest distance of a sample of a block from the last one, (blocks,) [m]."""
        last = self._last_of_blocks.repeat(SAMPLES_PER_BLOCK)[: len(self._samples)]
        away = self._samples - self._samples[last]
        squares = np.einsum("ij,ij->i", away, away)
        starts = np.arange(0, len(squares), SAMPLES_PER_BLOCK)
        reaches: Array = np.sqrt(np.maximum.reduceat(squares, starts)) + ROUNDING_M
        return reaches

    def _search_within(self, radius: float) -> None:
        """Compute the distances up to a radius [m], where that is not done."""
        if radius > self._radius:
            self._radius = radius
            self.__dict__.pop("_blocks", None)

    @cached_property
    def _blocks(self) -> list[tuple[list[int], Array]]:
        """Of each block the segments that come near it, and its samples' distances from them [m].

        A distance is infinite where the target had not come to the sample yet.
        """
        blocks = []
        count = len(self._starts)
        middles = np.arange(0, count, INSTANTS_PER_BLOCK)
        own = np.repeat(middles, INSTANTS_PER_BLOCK)[:count]
        begins, ends = self._starts - self._starts[own], self._ways
        ends = begins + ends
        squares = np.maximum(
            np.einsum("ij,ij->i", begins, begins), np.einsum("ij,ij->i", ends, ends)
        )
        reaches = np.sqrt(np.maximum.reduceat(squares, middles))
        away = cdist(self._samples[self._last_of_blocks], self._starts[middles])
        near = away <= self._radius + self._reaches[:, None] + reaches + ROUNDING_M
        for number, row in enumerate(near):
            segments = np.flatnonzero(row.repeat(INSTANTS_PER_BLOCK)[:count])
            first = SAMPLES_PER_BLOCK * number
            samples = np.arange(first, min(first + SAMPLES_PER_BLOCK, len(self._samples)))
            distances = self._distances(samples, segments)
            distances[segments < self._earliest[samples, None]] = np.inf
            blocks.append((segments.tolist(), distances))
        return blocks

    def _distances(self, samples: Indices, segments: Indices) -> Array:
        """Compute the distances of samples from segments, (samples, segments) [m]."""
        centre = self._samples[samples[-1]]  # near which rounding is least
        S, a = self._samples[samples] - centre, self._starts[segments] - centre
        d, squares = self._ways[segments], self._way_squares[segments]
        along = S @ d.T - np.einsum("ij,ij->i", a, d)
        share = np.clip(along / np.where(squares > 0, squares, 1.0), 0.0, 1.0)
        away = -2 * (S @ a.T)
        away += np.einsum("ij,ij->i", S, S)[:, None] + np.einsum("ij,ij->i", a, a)
        away += share * (share * squares - 2 * along)
        distances: Array = np.sqrt(np.maximum(away, 0.0))
        return np.maximum(distances, self._apart[segments], out=distances)
