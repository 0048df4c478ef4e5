"""The cells of a column of a table: what is taken over the trials of each law, who is best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import Literal

import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.metrics import METRICS
from dikbench.report.tables.kinds import Quantity, Statistic
from dikbench.report.tables.table import DIGITS, Column, TableCell
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.hierarchical_bootstrap import draw_weights, mean_intervals
from dikbench.statistics.shifted_mean import shift_near_median, shifted_geometric_mean
from dikbench.statistics.trial_matrix import TrialMatrix

SMALLEST_DIFFERENCE = 1e-6
"""What is smaller than this [m, rad, rad/s, a share] is as good as 0 when formulations are
compared."""

_AVERAGES = (Statistic.GEOMETRIC_MEAN, Statistic.MEAN)


def describe(quantity: Quantity, rows: pd.DataFrame) -> Column:
    """The column of a quantity; its shift is near the median over all trials."""
    metric = METRICS.get(quantity.of)
    better: Literal["low", "high"] | None = None
    if quantity.compared:
        better = metric.best if metric else "low"
    how, shift = quantity.statistic.value, nan
    if quantity.statistic is Statistic.GEOMETRIC_MEAN:
        shift = shift_near_median(rows[quantity.of].to_numpy(dtype=float))
        how += f" (shift {shift:g})"
    return Column(
        key=quantity.key,
        heading=quantity.heading,
        definition=f"{how} of: {quantity.definition}",
        better=better,
        interval=quantity.compared and quantity.statistic in _AVERAGES,
        count=quantity.statistic is Statistic.NUMBER,
        shift=shift,
    )


@dataclass(frozen=True, eq=False)
class Sample:
    """The trials of a block.

    Attributes:
        rows: of trials, with the columns `scenario_family` and `failed`, and failures at their
            worst; a formulation has one per case.
        layout: where each stands in a matrix of problems x formulations.
        weights: the resamples of its problems.
        unstable: whether the numbers of each formulation are times that cannot be trusted.
    """

    rows: pd.DataFrame
    layout: TrialMatrix
    weights: Array
    unstable: Mask

    @classmethod
    def of(cls, rows: pd.DataFrame, unstable: Mask) -> Sample:
        """Lay out rows and draw their resamples."""
        layout = TrialMatrix.of(rows)
        families = dict(zip(rows["scenario"], rows["scenario_family"], strict=True))
        scenarios = list(layout.cases["scenario"])
        weights = draw_weights([families[name] for name in scenarios], scenarios)
        return cls(rows, layout, weights, unstable)

    def cells(self, quantity: Quantity, column: Column) -> list[TableCell]:
        """The cells of a column, one per formulation."""
        matrix = self.layout.fill(self.rows[quantity.of].to_numpy(dtype=float))
        if quantity.statistic in _AVERAGES:
            matrix[np.isinf(matrix)] = nan  # of failures: an average cannot carry them
        values = [_taken(quantity.statistic, column, contender) for contender in matrix.T]
        intervals = np.full((len(values), 2), nan)
        if column.interval:
            intervals = self._intervals(matrix, column.shift)
        best = self._best(values, self._competes(matrix), column.better)
        return [
            TableCell(value, float(low), float(high), first, bool(unstable))
            for value, (low, high), first, unstable in zip(
                values, intervals, best, self.unstable, strict=True
            )
        ]

    def _intervals(self, matrix: Array, shift: float) -> Array:
        if isnan(shift):
            return mean_intervals(matrix, self.weights)
        logarithms = mean_intervals(np.log1p(matrix / shift), self.weights)
        bounds: Array = shift * np.expm1(logarithms)
        return bounds

    def _competes(self, matrix: Array) -> Mask:
        """Whether each law has a number wherever one was measured of any law that came through.

        The average over the scenarios that a formulation survived is no win. The oracle is no
        formulation.
        """
        contender = ~self.layout.contenders["formulation"].isin(ORACLES).to_numpy()
        came_through = self.layout.fill(1 - self.rows["failed"].to_numpy(dtype=float), 0.0) > 0
        has = ~np.isnan(matrix)
        asked = (has & came_through)[:, contender].any(axis=1, keepdims=True)
        competes: Mask = contender & (has | ~asked).all(axis=0)
        return competes

    @staticmethod
    def _best(values: Sequence[float], competes: Mask, better: str | None) -> list[bool]:
        """Which formulations are the best, to what counts; none where all are equally good."""
        merits = [_merit(value) for value in values]
        competing = {merit for merit, one in zip(merits, competes, strict=True) if one}
        competing = {merit for merit in competing if not isnan(merit)}
        if better is None or len(competing) < 2:
            return [False] * len(values)
        first = min(competing) if better == "low" else max(competing)
        return [bool(one) and merit == first for merit, one in zip(merits, competes, strict=True)]


def _merit(value: float) -> float:
    """A number as far as it counts when formulations are compared."""
    return 0.0 if abs(value) < SMALLEST_DIFFERENCE else float(f"{value:.{DIGITS}g}")


def _taken(statistic: Statistic, column: Column, values: Array) -> float:
    """A number from those of one formulation's trials, NaN where none is defined."""
    defined = values[~np.isnan(values)]
    if statistic is Statistic.NUMBER:
        return float(defined.sum())
    if not len(defined):
        return nan
    if statistic is Statistic.GEOMETRIC_MEAN:
        return shifted_geometric_mean(defined, column.shift)
    if statistic is Statistic.MEAN:
        return float(defined.mean())
    return float(defined.min() if column.better == "high" else defined.max())
