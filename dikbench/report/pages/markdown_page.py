"""report.md: the report in short, for a forge."""

from __future__ import annotations

from math import isnan
from typing import Final

import jinja2

from dikbench.report.contents.contents import Contents
from dikbench.report.pages.backticks import to_markdown
from dikbench.report.sentences.words import quoted, several
from dikbench.report.tables.markdown import aligned, escape, markdown_blocks, markdown_rows
from dikbench.report.tables.table import Table, TableCell, TableRow

MOST_ROWS: Final = 30
MOST_COLUMNS: Final = 8
"""Of a table that fits a screen; of a larger one only its place is told."""


def render_markdown(contents: Contents) -> str:
    """The page."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dikbench.report.pages"),
        autoescape=False,  # Markdown, not HTML: filters escape it
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "md": escape,
        "quoted": quoted,
        "spoken": to_markdown,
        "blocks": lambda table: markdown_blocks(table, table.overall),
        "rows": markdown_rows,
        "capitalize_first": lambda text: text[:1].upper() + text[1:],
    }
    success, *others = contents.tables
    return environment.get_template("report.md.j2").render(
        contents=contents,
        success=success,
        matrix=matrix(success),
        fitting=[table for table in others if fits(table)],
        larger=[table for table in others if not fits(table)],
    )


def fits(table: Table) -> bool:
    """Whether a table over all families fits a screen."""
    rows = sum(len(block.rows) for block in table.overall)
    return rows <= MOST_ROWS and len(table.shown) <= MOST_COLUMNS


def matrix(success: Table) -> str:
    """Write success by situation in whole percent, a row per formulation, the best first.

    It is of the first setting, with the first solver of each formulation. Who did not run every
    trial comes last.
    """
    if not success.overall:
        return escape(success.empty)
    block, overall = (
        success.overall[0],
        [column.key for column in success.columns].index("all_percent"),
    )
    first: dict[str, TableRow] = {}
    for row in block.rows:
        first.setdefault(row.formulation, row)
    most = max(row.cells[-1].value for row in first.values())

    def place(row: TableRow) -> tuple[bool, float]:
        rate, trials = row.cells[overall].value, row.cells[-1].value
        return isnan(rate) or trials < most, -rate

    ordered = sorted(first.values(), key=place)
    lines = [
        [
            escape(row.formulation if row.solver == "none" else f"{row.formulation}, {row.solver}"),
            *(_percent(cell) for cell in row.cells[:-1]),
            f"{row.cells[-1].value:.0f}",
        ]
        for row in ordered[:MOST_ROWS]
    ]
    columns = success.columns
    header = ["formulation", *(escape(column.short or column.heading) for column in columns)]
    said = [
        f"Success in percent, {block.setting}, a solver each, sorted by all situations, who ran "
        "fewer trials last. Who differs is a matter of the intervals in the table, not of places.",
        aligned(header, lines, [False, *(True for _ in columns)]),
        escape(block.note),
    ]
    if len(ordered) > MOST_ROWS:
        said[0] += f" The last {several(len(ordered) - MOST_ROWS, 'row')} stand there too."
    return "\n\n".join(part for part in said if part)


def _percent(cell: TableCell) -> str:
    """Write a rate; who is not told of a limit has none there."""
    return "-" if cell.text or isnan(cell.value) else f"{cell.value:.0f}"
