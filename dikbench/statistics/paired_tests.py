"""Tests and effect sizes of pairs: McNemar, Holm's correction, odds ratio, rank-biserial."""

from __future__ import annotations

import numpy as np
from scipy.stats import binomtest, rankdata

from dikbench.arrays import Array


def mcnemar(only_a: int, only_b: int) -> float:
    """Compute the exact two-sided p value that the discordant pairs are a fair coin's.

    It is 1 where no pair is discordant.

    Args:
        only_a: number of pairs in which A alone succeeds.
        only_b: number of those in which B alone does.

    Source: McNemar 1947, Note on the sampling error of the difference between correlated
    proportions; exact by the binomial distribution.
    """
    number = only_a + only_b
    return float(binomtest(only_a, number).pvalue) if number else 1.0


def odds_ratio(only_a: int, only_b: int) -> float:
    """Compute the conditional odds ratio of pairs, only A over only B; NaN where both are 0."""
    if not only_b:
        return np.inf if only_a else np.nan
    return only_a / only_b


def holm(p_values: Array) -> Array:
    """Correct p values, (k,), for being k: the family-wise error rate is kept.

    Source: Holm 1979, A simple sequentially rejective multiple test procedure.
    """
    order = np.argsort(p_values, kind="stable")
    factors = np.arange(len(p_values), 0, -1)
    corrected = np.empty(len(p_values))
    corrected[order] = np.minimum(np.maximum.accumulate(p_values[order] * factors), 1.0)
    return corrected


def rank_biserial(differences: Array) -> float:
    """Compute the matched-pairs rank-biserial correlation, -1 to 1; NaN without a difference.

    r = (R+ - R-) / (R+ + R-), with R+ and R- the sums of the ranks of |d| where d > 0 and d < 0;
    differences of 0 are left out, equal ones share their mean rank.

    Args:
        differences: d of each pair, (n,).

    Source: Kerby 2014, The simple difference formula.
    """
    apart = differences[differences != 0]
    if not len(apart):
        return float("nan")
    ranks = rankdata(np.abs(apart))
    return float((ranks @ np.sign(apart)) / ranks.sum())
