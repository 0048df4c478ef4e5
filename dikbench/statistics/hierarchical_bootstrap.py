"""Bootstrap intervals of means over levels, such as families and scenarios; never over ticks.

Trials are not independent: seeds of a scenario resemble one another, and so do the scenarios of a
robot and the robots of a family. So families are drawn with replacement, in each drawn family
robots, in each of those scenarios, and so on (Davison & Hinkley 1997, section 3.8): a mean draws
at the levels that it is a mean over. `scipy.stats.bootstrap` draws from one flat sample and cannot
express this; on a flat sample the two agree.

Indices are not drawn: a family drawn c times has its R robots drawn c R times in all, which is one
multinomial draw, and the same holds below. The result is weights, which are the same for all
formulations and metrics (so that their differences are resampled together), and a matrix product.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dikbench.arrays import Array, Indices

RESAMPLES = 2000
RESAMPLING_SEED = 20020101
INTERVAL_COVERAGE = 0.95


def draw_weights(
    *levels: Sequence[Any],
    resamples: int = RESAMPLES,
    seed: int = RESAMPLING_SEED,
) -> Array:
    """Count how often each trial is drawn in each resample, (resamples, n).

    Args:
        levels: what each of n trials belongs to at each level, from the outside in: its family,
            its scenario. Trials that agree at every level are drawn as such: they are the seeds.
        resamples: number of resamples.
        seed: of the drawing; the same seed gives the same intervals.
    """
    random = np.random.default_rng(seed)
    weights = np.empty((resamples, len(levels[0])))

    def draw(places: list[int], times: Indices, inner: Sequence[Sequence[Any]]) -> None:
        """Draw among the parts of some trials, which are drawn `times` (resamples,) in all."""
        if not inner:
            weights[:, places] = _equal_multinomial(random, times * len(places), len(places))
            return
        parts: dict[Any, list[int]] = {}
        for place in places:
            parts.setdefault(inner[0][place], []).append(place)
        drawn = _equal_multinomial(random, times * len(parts), len(parts))
        for share, members in zip(drawn.T, parts.values(), strict=True):
            draw(members, share, inner[1:])

    if len(levels[0]):
        draw(list(range(len(levels[0]))), np.ones(resamples, dtype=np.intp), levels)
    return weights


def mean_intervals(values: Array, weights: Array) -> Array:
    """Compute the 95 % percentile intervals of the means of columns, (k, 2).

    NaN where all values are equal or there is one, since values that did not occur cannot be
    resampled (ten trials without failure do not exclude one).

    Args:
        values: (n, k), a column per formulation; NaN counts nowhere.
        weights: (resamples, n), of `draw_weights`.
    """
    defined = ~np.isnan(values)
    number = weights @ defined.astype(float)
    sums = weights @ np.where(defined, values, 0.0)
    tails = ((1 - INTERVAL_COVERAGE) / 2, (1 + INTERVAL_COVERAGE) / 2)
    intervals = np.full((values.shape[1], 2), np.nan)
    spread = _largest(values) > -_largest(-values)
    for contender in np.flatnonzero(spread):
        hit = number[:, contender] > 0
        intervals[contender] = np.quantile(sums[hit, contender] / number[hit, contender], tails)
    return intervals


def _largest(values: Array) -> Array:
    """Return the largest number of each column, NaN where there is none."""
    largest: Array = np.fmax.reduce(values, axis=0, initial=np.nan)
    return largest


def _equal_multinomial(random: np.random.Generator, draws: Indices, boxes: int) -> Indices:
    """Draw the counts of `draws` (k,) balls in equally likely boxes, (k, boxes)."""
    return random.multinomial(draws, np.full(boxes, 1 / boxes))
