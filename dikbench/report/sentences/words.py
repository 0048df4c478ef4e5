"""Numbers and names in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import pandas as pd

from dikbench.statistics.success import Contender

FEW: Final = 6
"""More names than this are counted, not listed."""


NOT_TIMED: Final = (
    "No timing pass was made: `dikbench time`, with the study and the options of the run, makes it."
)
"""Stands in place of times that nobody took."""


def number(value: float) -> str:
    """Three significant digits, no exponent where it can be read without; rounding is 0."""
    if not math.isfinite(value):
        return str(value)
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.3g}" if 1e-4 <= abs(value) < 999.5 else _far(value)


def _far(value: float) -> str:
    return f"{value:.2e}" if abs(value) < 1e-4 or abs(value) >= 1e6 else f"{value:.0f}"


def several(count: int, what: str) -> str:
    """A count and its noun."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def listed(names: Sequence[str], most: int | None = FEW) -> str:
    """Names in a sentence: `a`, `b` and 5 more."""
    shown = list(names if most is None else names[:most])
    if len(shown) < len(names):
        return f"{', '.join(shown)} and {len(names) - len(shown)} more"
    return " and ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def quoted(name: str) -> str:
    """A name between backticks."""
    return f"`{' '.join(name.split()).replace('`', chr(39))}`"


class Names:
    """How formulations with their solvers are called in the sentences of one run.

    Args:
        rows: every trial of the run.
    """

    def __init__(self, rows: pd.DataFrame) -> None:
        pairs = rows[["formulation", "solver"]].drop_duplicates()
        self._solvers = pairs.groupby("formulation", sort=False)["solver"].agg(list).to_dict()

    def of(self, contenders: Iterable[Contender]) -> str:
        """The formulations in words, in order of the alphabet, whatever the order of the rows.

        Such as: `dls`, `lp-alpha` (`daqp`) and `qp` (all 8 solvers).
        """
        groups: dict[str, list[str]] = {}
        for formulation, solver in sorted(contenders):
            groups.setdefault(formulation, []).append(solver)
        return listed([self._named(*group) for group in groups.items()])

    def _named(self, formulation: str, solvers: list[str]) -> str:
        name, every = quoted(formulation), self._solvers[formulation]
        if len(every) == 1:
            return name
        others = sorted(solver for solver in every if solver not in solvers)
        if not others:
            return f"{name} ({'both' if len(every) == 2 else f'all {len(every)}'} solvers)"
        if len(others) < len(solvers):
            return f"{name} (all solvers but {listed([quoted(solver) for solver in others])})"
        return f"{name} ({listed([quoted(solver) for solver in solvers])})"
