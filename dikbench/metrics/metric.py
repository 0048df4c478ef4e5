"""Metrics, and the metrics of one series."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from dikbench.arrays import Array, Mask
from dikbench.metrics.motion import Motion
from dikbench.metrics.reductions import REDUCTIONS

INF: Final = float("inf")

Better = Literal["low", "high"]


@dataclass(frozen=True)
class Metric:
    """A number that measures a trial.

    Attributes:
        name: name of its column, with the unit at the end (see `unit_suffix`).
        unit: empty for a share, a ratio or a number of steps.
        best: which direction is better.
        worst: the value of a failed trial.
        definition: the definition in one line.
        of: computes it; NaN where the motion does not define it.
        source: key of its paper in `formulations/REFERENCES.md`.
    """

    name: str
    unit: str
    best: Better
    worst: float
    definition: str
    of: Callable[[Motion], float]
    source: str = "dikbench"


def series_metrics(
    name: str,
    unit: str,
    definition: str,
    values: Callable[[Motion], Array | Mask],
    *reductions: str,
    best: Better = "low",
    worst: float | None = None,
    source: str = "dikbench",
) -> tuple[Metric, ...]:
    """Make the metrics of one series: a value per step, or at the start and after each step.

    Args:
        name: beginning of their names; the reduction and the unit follow.
        unit: unit of the values; a share and a number of steps have none.
        definition: definition of the values, phrased to follow "largest" or "share of the steps".
        values: computes the values of a motion, (k,); a mask for a share or a number of steps.
        reductions: names of `REDUCTIONS`, in the order of the columns.
        best: which direction is better.
        worst: the value of a failed trial; default: 0 or 1 for a share, else infinite.
        source: key of their paper.
    """

    def metric(reduction: str) -> Metric:
        wording, reduce = REDUCTIONS[reduction].wording, REDUCTIONS[reduction].of
        own_unit = "" if reduction in ("share", "steps") else unit
        low, high = (1.0, 0.0) if reduction == "share" else (INF, -INF)
        return Metric(
            name="_".join(filter(None, (name, reduction, unit_suffix(own_unit)))),
            unit=own_unit,
            best=best,
            worst=worst if worst is not None else low if best == "low" else high,
            definition=wording.format(definition),
            of=lambda motion: reduce(motion.series(values)),
            source=source,
        )

    return tuple(map(metric, reductions))


def unit_suffix(unit: str) -> str:
    """Write a unit as the end of a column's name: rad/s^2 is rad_s2, 1/s is per_s."""
    return unit.replace("1/", "per_").replace("/", "_").replace(" ", "_").replace("^", "")
