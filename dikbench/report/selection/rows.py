"""Which rows of a table of trials are drawn, and in which order formulations stand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from dikbench.report.drawing.style import contender_name
from dikbench.report.selection.categories import categories
from dikbench.scenario.oracle import ORACLES

LEAST_ERROR = 1e-5
"""Nothing below this [m] is drawn: the axes are logarithmic."""


def that_ran(trials: pd.DataFrame) -> pd.DataFrame:
    """The trials that took a step, with a column `formulation` that names formulation and solver.

    Infinite numbers, which have no place on an axis, are missing ones here.
    """
    ran = trials[trials["status"].ne("skipped") & trials["steps"].gt(0)]
    ran = ran.replace([np.inf, -np.inf], np.nan)
    ran["contender"] = [
        contender_name(f, s) for f, s in zip(ran["formulation"], ran["solver"], strict=True)
    ]
    return ran


def names_of_contenders(rows: pd.DataFrame) -> dict[tuple[str, str], str]:
    """Return how formulations with their solvers are called; alone where there is one solver."""
    pairs = rows[["formulation", "solver"]].drop_duplicates()
    solvers = pairs["formulation"].value_counts()
    return {
        (formulation, solver): (
            contender_name(formulation, solver) if solvers[formulation] > 1 else formulation
        )
        for formulation, solver in pairs.itertuples(index=False, name=None)
    }


def one_solver_each(ran: pd.DataFrame) -> pd.DataFrame:
    """The rows of each formulation with the first of its solvers: curves that would coincide."""
    first = ran.groupby("formulation", sort=False)["solver"].transform("first")
    return ran[ran["solver"] == first]


def one_way(ran: pd.DataFrame) -> pd.DataFrame:
    """The rows of one plant and reference mode: ideal and time where they are, else the first."""
    chosen = ran
    for column, preferred in (("plant", "ideal"), ("reference", "time")):
        values = chosen[column]
        is_there = values.eq(preferred).any()
        chosen = chosen[values.eq(preferred if is_there else values.iloc[0])]
    return chosen


def how(rows: pd.DataFrame) -> str:
    """The plant and the reference mode of `one_way`, in words."""
    return f"{rows['plant'].iloc[0]} plant, {rows['reference'].iloc[0]}-indexed reference"


def error_column(ran: pd.DataFrame) -> tuple[str, str]:
    """The column that says how far a motion was from its path, and what it is called.

    The distance from the path where it was measured, else from the target: of that a formulation
    that slows down has a large one by design.
    """
    if "contour_error_rms_m" in ran and ran["contour_error_rms_m"].notna().any():
        return "contour_error_rms_m", "contour error"
    return "position_error_rms_m", "position error"


def failures_at_infinity(rows: pd.DataFrame, column: str) -> pd.Series:
    """A column of which less is better; infinite where the trial did not end well."""
    return rows[column].where(rows["status"].eq("ok"), np.inf)


def ranked(rows: pd.DataFrame, column: str) -> list[str]:
    """Order formulations: oracles, then by mean outcome, then by their median in a column.

    What stands still on its path is no better than what follows it.

    Args:
        rows: of trials.
        column: of which less is better.
    """
    worth = rows.assign(worth=failures_at_infinity(rows, column))
    worth = worth.assign(category=categories(rows))
    by_formulation = worth.groupby("formulation", sort=False)
    table = by_formulation.agg({"category": "mean", "worth": "median"})
    order = table.sort_values(["category", "worth"], kind="stable", na_position="last").index
    return sorted(order, key=lambda name: name not in ORACLES)


def pages(names: Sequence[str], most: int) -> list[list[str]]:
    """Names in parts of about equal length, of at most so many each."""
    count = -(-len(names) // most)
    return [list(part) for part in np.array_split(np.array(names, dtype=object), count)]
