"""A table as every renderer sees it: Markdown, CSV, LaTeX, HTML and the console."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isnan, nan
from typing import Literal

ALL = "all"
"""Stands for all families."""

DIGITS = 3
"""Significant digits that are shown; what agrees in them is equally good."""

NOT_TOLD = "does not see them"
"""Stands in place of a number of a formulation that is not told of obstacles or torques."""

ROUNDING = 1e-9
"""What is smaller than this is rounding, and shown as 0 (CSV keeps it)."""


def shown(value: float, most: float = inf) -> str:
    """A number as it is read: `DIGITS` significant digits, 0 where it is rounding.

    Args:
        value: the number.
        most: the largest one that breaks no limit; what breaks it is not rounded to one that does
            not, but has as many digits as that takes.
    """
    if abs(value) < ROUNDING:
        return "0"
    text = f"{value:.{DIGITS}g}"
    digits = DIGITS
    while float(text) <= most < value:
        digits += 1
        text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if 1e3 <= abs(float(text)) < 1e6 else text


@dataclass(frozen=True)
class Column:
    """A column of numbers.

    Attributes:
        key: its name in CSV, an identifier with the unit in it; the bounds of its interval stand
            beside it as `key_lower` and `key_upper`.
        heading: what stands above it, with the unit in brackets.
        definition: what the number is, in a line: the statistic, its shift, the metric.
        better: which direction is better; None where neither is (a count of trials).
        interval: whether its cells carry an interval.
        count: whether its cells are whole numbers.
        shown: whether it is shown, or stands in the CSV alone.
        short: its heading where there is little room; empty: `heading`.
        whole: whether it is rounded to whole numbers where there is little room.
        most: the largest number in it that breaks no limit (see `shown`).
    """

    key: str
    heading: str
    definition: str
    better: Literal["low", "high"] | None = None
    interval: bool = False
    count: bool = False
    shown: bool = True
    short: str = ""
    whole: bool = False
    most: float = inf


@dataclass(frozen=True)
class TableCell:
    """A number in a table.

    Attributes:
        value: the number; NaN where nothing was measured, infinite where a failed trial's is.
        lower: lower end of its 95 % interval; NaN where there is none.
        upper: upper end of it.
        best: whether no other formulation of the block has a better one (several may be equally
            good).
        unstable: whether it rests on times that cannot be trusted: to be greyed.
        text: what stands in place of the number; empty: the number.
    """

    value: float
    lower: float = nan
    upper: float = nan
    best: bool = False
    unstable: bool = False
    text: str = ""

    @property
    def has_interval(self) -> bool:
        """Whether there is an interval that, as it is shown, is more than a number."""
        bounds = (self.lower, self.upper)
        return not any(map(isnan, bounds)) and len({*map(shown, bounds)}) > 1


@dataclass(frozen=True)
class TableRow:
    """What a formulation with its solver achieved.

    Attributes:
        formulation: selector of the formulation, as the user wrote it: escape it.
        solver: selector of the solver, or `none`.
        cells: one per column of the table.
    """

    formulation: str
    solver: str
    cells: tuple[TableCell, ...]


@dataclass(frozen=True)
class Block:
    """Rows that may be compared with one another: same scenarios, plant and reference mode.

    Attributes:
        family: of the scenarios, or `ALL`.
        plant: selector of the plant; None where the table does not tell plants apart (times).
        reference: `time` or `path`; None likewise.
        rows: one per formulation and solver, in the order of the trials.
        note: a sentence that belongs under these rows; empty where there is none.
    """

    family: str
    plant: str | None
    reference: str | None
    rows: tuple[TableRow, ...]
    note: str = ""

    @property
    def setting(self) -> str:
        """Plant and reference mode in words; empty for times."""
        if self.plant is None:
            return ""
        waits = "the path may wait" if self.reference == "path" else "the clock does not wait"
        return f"{waits} ({self.plant} plant)"


@dataclass(frozen=True)
class Table:
    """A table: the blocks over all families first, then those of each family.

    Attributes:
        name: of its files.
        title: one line above it.
        columns: what the cells of a row are, failures first.
        blocks: its parts, each to be headed by its family, plant and reference mode.
        notes: sentences that belong under it: how the numbers were taken.
        empty: what is said where it has no blocks.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    blocks: tuple[Block, ...]
    notes: Sequence[str]
    empty: str = "Nothing was measured."

    @property
    def shown(self) -> tuple[int, ...]:
        """The places of the columns that are shown."""
        return tuple(place for place, column in enumerate(self.columns) if column.shown)

    @property
    def counts_first(self) -> tuple[int, ...]:
        """The same, numbers of trials first: they stay where there is room for few columns."""
        return tuple(sorted(self.shown, key=lambda place: not self._is_sample(place)))

    def _is_sample(self, place: int) -> bool:
        return self.columns[place].key in {"trials", "runs", "scenarios"}

    @property
    def overall(self) -> tuple[Block, ...]:
        """The blocks over all families."""
        return tuple(block for block in self.blocks if block.family == ALL)
