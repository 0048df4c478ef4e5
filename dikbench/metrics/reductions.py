"""The reductions of a series of values to one number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt
from types import MappingProxyType
from typing import Any

import numpy as np

from dikbench.arrays import Array, Mask


@dataclass(frozen=True)
class Reduction:
    """A reduction of a series to a number.

    Attributes:
        wording: its wording in definitions, with {} for the definition of the series.
        of: computes it from values or a mask, (k,).
    """

    wording: str
    of: Callable[[Any], float]


def rms(values: Array) -> float:
    """Compute the root mean square; NaN without values."""
    return sqrt(np.add.reduce(values * values) / len(values)) if len(values) else float("nan")


def largest(values: Array) -> float:
    """Return the largest of the values that are defined; NaN where none is."""
    return float(np.fmax.reduce(values)) if len(values) else float("nan")


def smallest(values: Array) -> float:
    """Return the smallest of the values that are defined; NaN where none is."""
    return float(np.fmin.reduce(values)) if len(values) else float("nan")


def percentile_95(values: Array) -> float:
    """Compute the 95 % quantile, linear between two of the values; NaN of nothing."""
    if not len(values):
        return float("nan")
    ordered = np.sort(values)  # np.percentile takes ten times as long
    place = 0.95 * (len(values) - 1)
    below = ordered[int(place)]
    above = ordered[min(int(place) + 1, len(values) - 1)]
    return float(below + (place - int(place)) * (above - below))


def last(values: Array) -> float:
    """Return the last value; NaN of nothing."""
    return float(values[-1]) if len(values) else float("nan")


def mean(values: Array | Mask) -> float:
    """Compute the mean, of a mask the share that is set; NaN of nothing."""
    return float(np.add.reduce(values) / len(values)) if len(values) else float("nan")


def number_set(mask: Mask) -> float:
    """Count the values of a mask that are set."""
    return float(np.count_nonzero(mask))


REDUCTIONS: Mapping[str, Reduction] = MappingProxyType(
    {
        "rms": Reduction("root mean square {}", rms),
        "p95": Reduction("95 % quantile of the {}", percentile_95),
        "max": Reduction("largest {}", largest),
        "min": Reduction("smallest {}", smallest),
        "mean": Reduction("mean {}", mean),
        "final": Reduction("final {}", last),
        "share": Reduction("share of the steps {}", mean),
        "steps": Reduction("number of steps {}", number_set),
    }
)
"""The reductions by their names in columns."""
