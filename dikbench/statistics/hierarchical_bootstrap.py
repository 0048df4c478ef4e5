"""Bootstrap intervals of means over scenario families, scenarios and seeds; never over ticks.

Trials are not independent: seeds of a scenario resemble one another, and so do the scenarios of a
family. So families are drawn with replacement, in each drawn family scenarios, in each of those
seeds (Davison & Hinkley 1997, section 3.8). `scipy.stats.bootstrap` draws from one flat sample and
cannot express this; on a flat sample the two agree.

Indices are not drawn: a family drawn c times has its S scenarios drawn c S times in all, which is
one multinomial draw, and the same holds for seeds. The result is weights, which are the same for
all formulations and metrics (so that their differences are resampled together), and a matrix
product.
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
    families: Sequence[Any],
    scenarios: Sequence[Any],
    resamples: int = RESAMPLES,
    seed: int = RESAMPLING_SEED,
) -> Array:
    """Count how often each trial is drawn in each resample, (resamples, n).

    Args:
        families: the family of each of n trials.
        scenarios: the scenario of each, distinguished within its family. Trials of one scenario are
            its seeds.
        resamples: number of resamples.
        seed: of the drawing; the same seed gives the same intervals.
    """
    random = np.random.default_rng(seed)
    tree: dict[Any, dict[Any, list[int]]] = {}
    for place, (family, scenario) in enumerate(zip(families, scenarios, strict=True)):
        tree.setdefault(family, {}).setdefault(scenario, []).append(place)
    weights = np.empty((resamples, len(families)))
    if not tree:
        return weights
    drawn = _equal_multinomial(random, np.full(resamples, len(tree)), len(tree))
    for times, members in zip(drawn.T, tree.values(), strict=True):
        inside = _equal_multinomial(random, times * len(members), len(members))
        for share, places in zip(inside.T, members.values(), strict=True):
            weights[:, places] = _equal_multinomial(random, share * len(places), len(places))
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
