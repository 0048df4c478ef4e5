"""Stored traces for figures against time: the runs of one scenario, a few laws to a panel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics import Motion, motion_of
from dikbench.plugins.built_scenarios import built
from dikbench.report.selection.rows import error_column, one_way, ranked
from dikbench.results.folder import ResultsFolder
from dikbench.simulation.trace import Trace

PER_PANEL: Final = 5
"""Curves in one panel: as many as can be told apart."""

FEWEST_POINTS: Final = 50
MOST_POINTS: Final = 300
ALL_POINTS: Final = 9000
"""Points of a curve, and of all curves of a figure together."""


def stored_motions(folder: ResultsFolder, ran: pd.DataFrame, scenario: str) -> dict[str, Motion]:
    """The motions of one scenario whose traces are stored, per law, the best law first.

    One plant and one reference mode, the first seed.
    """
    rows = ran[ran["scenario"].eq(scenario)]
    if rows.empty:
        return {}
    rows = one_way(rows)
    rows = rows[rows["seed"].eq(rows["seed"].iloc[0])].drop_duplicates("formulation")
    column, _ = error_column(rows)
    files = {
        row.formulation: path
        for row in rows.itertuples()
        if (path := folder.trace(str(row.id))).is_file()
    }
    if not files:
        return {}
    names = [name for name in ranked(rows, column) if name in files]
    case = built(scenario, int(rows["seed"].iloc[0]))
    if isinstance(case, str):  # the results are of another machine, which has more scenarios
        return {}
    try:
        return {name: motion_of(Trace.load(files[name]), case) for name in names}
    except DikbenchError:  # the traces are of another version of the scenario
        return {}


def points_per_curve(curves: int) -> int:
    """How many points each of so many curves may have."""
    return int(np.clip(ALL_POINTS // max(curves, 1), FEWEST_POINTS, MOST_POINTS))


def thinned(
    values: Array, dt: float, most: int, extreme: Callable[..., Any] = np.fmax
) -> tuple[Array, Array]:
    """Times and the largest (or other extreme) value of each of at most so many stretches."""
    starts = np.unique(np.linspace(0, len(values), min(most, len(values)) + 1)[:-1].astype(int))
    kept: Array = extreme.reduceat(values, starts)  # type: ignore[attr-defined]
    return starts * dt, kept


def in_panels(names: Sequence[str]) -> list[list[str]]:
    """Names in their order, so many to a panel."""
    return [list(names[k : k + PER_PANEL]) for k in range(0, len(names), PER_PANEL)]
