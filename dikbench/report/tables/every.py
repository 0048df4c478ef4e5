"""All tables of a report."""

from __future__ import annotations

import pandas as pd

from dikbench.metrics import METRICS
from dikbench.report.tables.build import make_table
from dikbench.report.tables.kinds import KINDS
from dikbench.report.tables.outcomes import outcome_table
from dikbench.report.tables.solver_axis import SHOWN, SOLVERS, solver_axis
from dikbench.report.tables.success import success_table
from dikbench.report.tables.table import Table


def tables_with(column: str) -> list[str]:
    """Return the names of the tables in which a column of the trials stands by itself."""
    found = [kind.name for kind in KINDS if any(each.of == column for each in kind.quantities)]
    return [*found, SOLVERS] if column in SHOWN else found


def make_tables(trials: pd.DataFrame) -> list[Table]:
    """Make success, outcomes, tracking error, limit violation, timing and solvers.

    Args:
        trials: the rows of trials.csv.
    """
    unknown = [name for name in METRICS if trials[name].isna().all()]
    measured = trials.drop(columns=unknown)
    return [
        success_table(trials),
        outcome_table(trials),
        *(make_table(kind, measured) for kind in KINDS),
        solver_axis(trials),
    ]
