"""The solver axis: what each solver, interface and preset makes of the same formulations."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from math import nan
from typing import Final

import pandas as pd

from dikbench.report.selection.judged import judged_rows
from dikbench.report.sentences.words import NOT_TIMED
from dikbench.report.tables.kinds import MS, PERCENT
from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, TableRow
from dikbench.statistics.failures import ran
from dikbench.statistics.success import rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER
from dikbench.study.trial import NO_SOLVER

SOLVERS: Final = "solvers"
"""Name of the table."""

SHOWN: Final = (
    "solver_failed_share",
    "not_verified_share",
    "primal_residual_max_rad_s",
    "optimum_distance_max_rad_s",
)
"""Metrics that stand in it, in the order of its columns."""

COLUMNS = (
    Column("runs", "runs", "number of runs, of any plant and reference", count=True),
    Column(
        "judged",
        "of them judged",
        "number of those runs that success is of: on the plant of the table of success, where the "
        "path may wait or the target is at rest, of scenarios that a known motion can do",
        count=True,
    ),
    Column(
        "success_percent",
        "their success [%]",
        "rate of success of the judged runs, families weighed equally, as in the last column of "
        "the table of success where the path may wait",
        "high",
    ),
    Column(
        "without_answer_percent",
        "steps without an answer [%]",
        "share of all steps in which the solver gave no answer although a feasible point exists",
        "low",
    ),
    Column(
        "not_verified_percent",
        "steps not verified [%]",
        "share of all steps whose answer failed the recheck by our own residuals",
        "low",
    ),
    Column(
        "residual_worst",
        "residual worst [rad/s]",
        "largest primal residual of all steps, answered or not",
        "low",
    ),
    Column(
        "optimum_worst",
        "from optimum worst [rad/s]",
        "largest distance from the optimum",
        "low",
        shown=False,
    ),
    Column("median_ms", "median call [ms]", "median over scenarios of the median call", "low"),
    Column("p99_ms", "99 % of the calls [ms]", "median over scenarios of the 99 % quantile", "low"),
)


def solver_axis(trials: pd.DataFrame) -> Table:
    """Make a row per formulation and solver, of formulations that were run with a solver.

    Args:
        trials: the rows of trials.csv.
    """
    rows = ran(trials)
    rows = rows[rows["solver"].ne(str(NO_SOLVER))]
    success: dict[Hashable, tuple[int, float]] = {}
    if len(rows):
        judged = judged_rows(rows, "path")
        if len(judged):
            found = rates(judged, succeeded(judged))
            names = found.contenders.itertuples(index=False, name=None)
            numbers = zip(found.trials.tolist(), found.rate.tolist(), strict=True)
            success = dict(zip(names, numbers, strict=True))
    made = [
        TableRow(str(name), str(solver), _cells(part, *success.get(contender, (0, nan))))
        for contender, part in rows.groupby(CONTENDER, sort=False)
        for name, solver in [contender]
    ]
    blocks = (Block(ALL, None, None, tuple(made)),) if made else ()
    timed = bool(rows["formulation_time_median_us"].notna().any())
    columns = tuple(
        replace(column, shown=column.shown and (timed or not column.key.endswith("_ms")))
        for column in COLUMNS
    )
    notes = (
        "Steps and residuals are of all runs, success of those that are judged.",
        "Times are those of the timing pass, medians over the scenarios on which a row was timed "
        "(of an even number the mean of the two in the middle)."
        if timed
        else NOT_TIMED,
    )
    return Table(SOLVERS, "Solvers on the same formulations", columns, blocks, notes)


def _cells(part: pd.DataFrame, judged: int, success: float) -> tuple[TableCell, ...]:
    steps = part["steps"].to_numpy(dtype=float)

    def of_all_steps(column: str) -> float:
        shares = part[column].fillna(0.0).to_numpy(dtype=float)
        return PERCENT * float(shares @ steps / steps.sum()) if steps.sum() else nan

    times = part.drop_duplicates("scenario")
    numbers = (
        len(part),
        judged,
        PERCENT * success,
        *map(of_all_steps, SHOWN[:2]),
        *(part[column].max() for column in SHOWN[2:]),
        MS * times["formulation_time_median_us"].median(),
        MS * times["formulation_time_p99_us"].median(),
    )
    return tuple(TableCell(float(number)) for number in numbers)
