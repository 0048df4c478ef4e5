"""The tables as they are printed at the end of a run: over all families, what fits a screen."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from textwrap import wrap

from dikbench.report.tables.table import NOT_TOLD, Block, Column, Table, TableCell, TableRow, shown

WIDTH = 120
"""Characters to a line."""

BLOCKS = 2
"""Plants and reference modes that are printed of a table; the others stand in the files."""

ROWS = 24
"""Formulations that are printed of a block."""

NAME = 40
"""Characters of a formulation with its solver."""

UNSEEN = "unseen"
"""Stands for `NOT_TOLD`."""

HEADING = 12
"""Characters to a line of a heading, unless a word is longer ..."""

NARROW = 8
"""... and of one above whole numbers."""


def to_text(table: Table) -> str:
    """Write the blocks over all families, formulations in the order of the study.

    The first columns that fit are printed. Who is first in a column is starred, times that cannot
    be trusted are followed by a question mark.
    """
    parts = [table.title, *(_block(table, block) for block in table.overall[:BLOCKS])]
    if not table.blocks:
        parts.append(table.empty)
    left = len(table.overall) - BLOCKS
    if left > 0:
        parts.append(f"Other plants and reference modes ({left}): tables/{table.name}.md")
    return "\n\n".join(parts) + "\n"


def _block(table: Table, block: Block) -> str:
    top = block.rows[:ROWS]
    columns = [["formulation", *(_name(row) for row in top)]]
    for place in table.shown:
        column = table.columns[place]
        heading = wrap(
            column.short or column.heading,
            NARROW if column.whole else HEADING,
            break_long_words=False,
        )
        columns.append(["\n".join(heading), *(_text(column, row.cells[place]) for row in top)])
    lines = [block.setting] if block.setting else []
    lines += _fitting(columns)
    if any(cell.text == NOT_TOLD for row in top for cell in row.cells):
        lines.append(f"{UNSEEN}: {NOT_TOLD}")
    lines += wrap(block.note, WIDTH)
    if len(block.rows) > ROWS:
        lines.append(f"and {len(block.rows) - ROWS} more: tables/{table.name}.md")
    return "\n".join(lines)


def _fitting(columns: Sequence[Sequence[str]]) -> list[str]:
    """Lines of the first columns that fit, under headings of several lines."""
    headings = [heading.split("\n") for heading, *_ in columns]
    height = max(map(len, headings))
    lines = [""] * (height + len(columns[0]) - 1)
    for place, (heading, column) in enumerate(zip(headings, columns, strict=True)):
        whole = [*[""] * (height - len(heading)), *heading, *column[1:]]
        longest = max(map(len, whole))
        if place == 0:
            lines = [text.ljust(longest) for text in whole]
        elif len(lines[0]) + 2 + longest > WIDTH:
            break
        else:
            lines = [
                f"{line}  {text.rjust(longest)}" for line, text in zip(lines, whole, strict=True)
            ]
    return [line.rstrip() for line in lines if line.strip()]


def _name(row: TableRow) -> str:
    name = row.formulation if row.solver == "none" else f"{row.formulation}, {row.solver}"
    line = "".join(character for character in " ".join(name.split()) if character.isprintable())
    return line if len(line) <= NAME else f"{line[: NAME - 3]}..."


def _text(column: Column, cell: TableCell) -> str:
    if cell.text:
        return f"{UNSEEN if cell.text == NOT_TOLD else cell.text} "
    if isnan(cell.value):
        return ""
    if column.count:
        return f"{cell.value:.0f} "
    number = f"{cell.value:.0f}" if column.whole else shown(cell.value, column.most)
    return number + "?" * cell.unstable + ("*" if cell.best else " ")
