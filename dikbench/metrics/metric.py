"""What a metric is, and the reductions of a motion's arrays to one number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.metrics.motion import Motion

Table = Literal["tracking error", "limit violation", "smoothness", "solver"]

INF: Final = float("inf")

NEGLIGIBLE: Final = 1e-4
"""A step that passes a limit by less than this [rad, rad/s] is not counted as a violation: that is
a solver's tolerance, and its size stands in the columns beside."""


@dataclass(frozen=True)
class Metric:
    """A number that says how a trial went.

    Attributes:
        name: its column, with the unit at the end.
        unit: empty for a share, a ratio or a number of steps.
        best: which direction is better.
        worst: the value of a trial that came to nothing.
        table: the table in which it stands.
        definition: one line.
        of: computes it; NaN where the motion does not define it.
        source: the paper that it is from, by its key in `formulations/REFERENCES.md`.
    """

    name: str
    unit: str
    best: Literal["low", "high"]
    worst: float
    table: Table
    definition: str
    of: Callable[[Motion], float]
    source: str = "dikbench"


def rms(values: Array) -> float:
    """Root mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def largest(values: Array) -> float:
    """The largest of the values that are defined; NaN where none is."""
    defined = values[~np.isnan(values)]
    return float(defined.max()) if len(defined) else float("nan")


def percentile_95(values: Array) -> float:
    """What 95 % of the values do not exceed, between two of them in proportion; NaN of nothing."""
    if not len(values):
        return float("nan")
    ordered = np.sort(values)  # np.percentile costs ten times as much
    place = 0.95 * (len(values) - 1)
    below = ordered[int(place)]
    above = ordered[min(int(place) + 1, len(values) - 1)]
    return float(below + (place - int(place)) * (above - below))


def last(values: Array) -> float:
    """The last one; NaN of nothing."""
    return float(values[-1]) if len(values) else float("nan")


def mean(values: Array | Mask) -> float:
    """Mean, of a mask the share that is set; NaN of nothing."""
    return float(np.mean(values)) if len(values) else float("nan")
