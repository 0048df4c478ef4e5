"""Everything that a report concludes, as lines: its sentences and its stars."""

from __future__ import annotations

import pandas as pd

from dikbench.report.sentences.summary import summarise
from dikbench.report.tables.success import success_table


def conclusions(trials: pd.DataFrame) -> list[str]:
    """Return every sentence of the summary, headlines too, and every star of the table of success.

    Args:
        trials: the rows of trials.csv.
    """
    summary, table = summarise(trials), success_table(trials)
    lines = [f"basis: {summary.basis}"]
    lines += summary.headlines
    lines += [f"{finding.question}: {finding.text}" for finding in summary.short]
    for chapter in summary.chapters:
        lines += [f"{chapter.situation}: {each.question}: {each.text}" for each in chapter.findings]
    for block in table.blocks:
        lines += [f"{block.setting}: {block.note}"] if block.note else []
        for row in block.rows:
            lines += [
                f"star: {block.setting}: {column.heading}: {row.formulation} {row.solver}"
                for column, cell in zip(table.columns, row.cells, strict=True)
                if cell.best
            ]
    return lines
