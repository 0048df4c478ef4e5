"""The axis of a swept parameter: a place for each of its values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array

DECADE: Final = 10.0
"""Values that span more than this stand on a logarithmic scale."""

APART: Final = 0.25
"""How far left of the others 0 stands on a logarithmic scale, as a share of their span."""

CLOSEST: Final = 0.07
"""Labels nearer than this share of the axis are left out, the values in between first."""


class ValueScale:
    """Places of the values of a parameter: logarithmic where they span a decade, 0 apart.

    Attributes:
        values: ascending.
        places: of them, in the units of the axis.
    """

    def __init__(self, values: Iterable[float]) -> None:
        self.values = np.unique(np.array(list(values), dtype=float))
        positive = self.values[self.values > 0]
        self._logarithmic = (
            self.values[0] >= 0 and len(positive) > 1 and positive[-1] >= DECADE * positive[0]
        )
        self._least = float(positive[0]) if self._logarithmic else 1.0
        self._span = float(np.log10(positive[-1] / positive[0])) if self._logarithmic else 1.0
        self.places = self.place(self.values)

    def place(self, values: Iterable[float]) -> Array:
        """Where values stand."""
        given = np.array(list(values), dtype=float)
        if not self._logarithmic:
            return given
        places: Array = np.full(len(given), -APART * self._span)
        places[given > 0] = np.log10(given[given > 0] / self._least)
        return places

    def curve(self, values: Array, heights: Array) -> tuple[Array, Array]:
        """A curve over ascending values, broken between 0 and the others where 0 stands apart."""
        places = self.place(values)
        if not (self._logarithmic and len(values) and values[0] == 0.0):
            return places, heights
        return np.insert(places, 1, np.nan), np.insert(heights, 1, np.nan)

    def label(self, axes: Sequence[Any]) -> None:
        """Write the values at the x axis that some axes share, as many as there is room for."""
        low, high = float(self.places[0]), float(self.places[-1])
        margin = 0.04 * (high - low) or 0.5
        kept: list[int] = []
        for index in (0, len(self.values) - 1, *range(1, len(self.values) - 1)):
            near = [abs(self.places[index] - self.places[other]) for other in kept]
            if min(near, default=np.inf) >= CLOSEST * (high - low + 2 * margin):
                kept.append(index)
        axes[0].set_xlim(low - margin, high + margin)
        axes[0].set_xticks(self.places[kept], [f"{value:g}" for value in self.values[kept]])
        for axis in axes:
            axis.tick_params(axis="x", labelrotation=90)
