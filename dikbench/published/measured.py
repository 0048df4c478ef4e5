"""A measured number, its noise band, and the verdict on a row of a published table."""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan, nan, sqrt
from typing import Final

import msgspec
import numpy as np

from dikbench.arrays import Array, Mask

EQUAL: Final = "equal"
INSIDE_NOISE: Final = "inside noise"
NOT_REPRODUCED: Final = "not reproduced"

DEVIATIONS: Final = 2.0
"""Half of a noise band, in standard errors."""


class Statistic(msgspec.Struct, frozen=True):
    """A column of a published table.

    Attributes:
        heading: what it is, with its unit.
        digits: decimal digits that are printed.
        significant: significant digits, where those are what is printed.
        extreme: whether it is the largest of a sample, which has no band and decides nothing.
    """

    heading: str
    digits: int = 2
    significant: int = 0
    extreme: bool = False

    def text(self, value: float) -> str:
        """Write a value as the source prints it."""
        if isnan(value):
            return "-"
        if self.significant:
            return f"{value:.{self.significant - 1}e}"
        return f"{value:.{self.digits}f}"


class Measured(msgspec.Struct, frozen=True):
    """A measured number and the band in which another sample of it lies.

    Attributes:
        value: the number.
        low: lower end of the band; NaN where there is none.
        high: upper end.
    """

    value: float
    low: float = nan
    high: float = nan


def of_mean(sample: Array, others: int = 0) -> Measured:
    """Measure a mean; the band is two standard errors.

    Args:
        sample: (n,).
        others: size of the published sample; 0: it is this one, so that only a few trials differ
            and the band of one sample is ample.
    """
    if not len(sample):
        return Measured(nan)
    return _around(float(np.mean(sample)), float(np.std(sample)), len(sample), others)


def of_share(counted: Mask, others: int = 0) -> Measured:
    """Measure a share in percent; the band is two binomial standard deviations."""
    share = float(np.mean(counted))
    return _around(100 * share, 100 * sqrt(share * (1 - share)), len(counted), others)


def of_count(counted: Mask) -> Measured:
    """Measure a number of trials; the band is two binomial standard deviations."""
    share, n = of_share(counted), len(counted)
    return Measured(*(n / 100 * x for x in (share.value, share.low, share.high)))


def of_median(sample: Array) -> Measured:
    """Measure a median; the band is between the order statistics two deviations from the middle."""
    if not len(sample):
        return Measured(nan)
    ranked, middle = np.sort(sample), len(sample) / 2
    away = DEVIATIONS * sqrt(len(sample)) / 2
    low, high = (int(np.clip(middle + s * away, 0, len(sample) - 1)) for s in (-1, 1))
    return Measured(float(np.median(sample)), float(ranked[low]), float(ranked[high]))


def _around(value: float, deviation: float, n: int, others: int) -> Measured:
    sizes = 1 / n + (1 / others if others else 0.0)
    away = DEVIATIONS * deviation * sqrt(sizes)
    return Measured(value, value - away, value + away)


def verdict(
    statistics: Mapping[str, Statistic],
    published: Mapping[str, float],
    measured: Mapping[str, Measured],
) -> str:
    """Say whether a published row came out again.

    `equal`: every number is, as printed. `inside noise`: every one lies in its band, but for the
    largest of a sample. `not reproduced`: one does not; it is named. `ours`: nothing was published.
    """
    if not published:
        return "ours"
    differing = [name for name in published if _differs(statistics, name, published, measured)]
    if not differing:
        return EQUAL
    outside = [
        name
        for name in differing
        if not statistics[name].extreme
        and not measured[name].low <= published[name] <= measured[name].high
    ]
    if not outside:
        return INSIDE_NOISE
    return f"{NOT_REPRODUCED}: {', '.join(statistics[name].heading for name in outside)}"


def _differs(
    statistics: Mapping[str, Statistic],
    name: str,
    published: Mapping[str, float],
    measured: Mapping[str, Measured],
) -> bool:
    text = statistics[name].text
    return text(published[name]) != text(measured[name].value)
