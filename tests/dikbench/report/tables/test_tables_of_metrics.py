"""What `dikbench show` says of a metric against the tables that are written."""

from __future__ import annotations

import re

from makers.rows import random_rows

from dikbench.cli.listing import description
from dikbench.metrics import METRICS
from dikbench.report.tables.build import make_table
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.kinds import KINDS


def test_show_names_the_tables_in_which_a_metric_stands() -> None:
    """Those with a column of its name, or of its worst value; every metric in some way.

    The rest of what it says is what the registry says, and the direction in words.
    """
    trials = random_rows(["pinv", "dls"], ["reach"])
    headings = {
        kind.name: to_csv(make_table(kind, trials)).partition("\n")[0].split(",") for kind in KINDS
    }
    in_none = 0
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
        found = [table for table, keys in headings.items() if {name, f"{name}_worst"} & {*keys}]
        in_none += not found
        assert tables == f"  tables: {', '.join(found) or 'none; a column of trials.csv'}"
    assert 0 < in_none < len(METRICS)
