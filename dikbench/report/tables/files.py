"""Write a table in every form that is a file of its own."""

from __future__ import annotations

from pathlib import Path

from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.latex_table import to_latex, to_latex_per_family
from dikbench.report.tables.markdown import to_markdown
from dikbench.report.tables.table import Table


def write_table(table: Table, folder: Path) -> None:
    """Write NAME.md, NAME.csv, NAME.tex (over all families) and NAME_per_family.tex."""
    folder.mkdir(exist_ok=True)
    for suffix, text in (
        (".md", to_markdown(table)),
        (".csv", to_csv(table)),
        (".tex", to_latex(table)),
        ("_per_family.tex", to_latex_per_family(table)),
    ):
        (folder / f"{table.name}{suffix}").write_text(text, encoding="utf-8")
