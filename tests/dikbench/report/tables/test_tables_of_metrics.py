"""What `dikbench show` says of a metric against the tables that are written."""

from __future__ import annotations

import re

from makers.rows import random_rows

from dikbench.cli.describing import description
from dikbench.metrics import METRICS
from dikbench.report.tables.build import make_table
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.kinds import KINDS
from dikbench.report.tables.solver_axis import solver_axis


def test_show_names_the_tables_in_which_a_metric_stands() -> None:
    """Those whose numbers change with it; the rest of what it says is what the registry says."""
    trials = random_rows([("pinv", "daqp"), ("dls", "daqp")], ["reach"])

    def written(*columns: str) -> dict[str, str]:
        changed = trials.assign(**{column: trials[column] * 1.5 for column in columns})
        tables = [*(make_table(kind, changed) for kind in KINDS), solver_axis(changed)]
        return {table.name: to_csv(table) for table in tables}

    before = written()
    in_none = [
        name for name in METRICS if "  tables: none; a column of trials.csv" in description(name)
    ]
    assert 0 < len(in_none) < len(METRICS)
    assert written(*in_none) == before
    for name, metric in METRICS.items():
        first, facts, tables, source = description(name).splitlines()
        assert first == f"{name}: {metric.definition}"
        unit, direction, worst = re.findall(
            r"unit: (.*); (\w+) is better; worst value (.*)", facts
        )[0]
        assert unit == (metric.unit or "none")
        assert direction == {"low": "lower", "high": "higher"}[metric.best]
        assert float(worst) == metric.worst
        assert source == f"  source: {metric.source.strip('[]')}"
        if name not in in_none:
            after = written(name)
            found = [table for table in before if after[table] != before[table]]
            assert found
            assert tables == f"  tables: {', '.join(found)}", name
