"""Markdown: text that stands for itself, aligned tables, and the tables of the report."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from math import inf, isnan

import pandas as pd

from dikbench.report.tables.table import ALL, Block, Column, Table, TableCell, shown

_ENTITIES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})
_SPECIAL = re.compile(
    r"[\\`*|~$]"  # anywhere
    r"|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])"  # not inside a word
    r"|(?<=\])[(\[]"  # what would make a link of brackets
)


def escape(text: str) -> str:
    """Text as one line of Markdown that shows it as it is, in a table too."""
    line = " ".join(text.split())
    printable = "".join(character for character in line if character.isprintable())
    return _SPECIAL.sub(r"\\\g<0>", printable).translate(_ENTITIES)


def aligned(header: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[bool]) -> str:
    """A Markdown table of cells that are escaped already, to be read as text too.

    Args:
        header: of the columns.
        rows: their cells.
        right: whether each column stands to the right.
    """
    widths = [max(3, *(len(row[i]) for row in (header, *rows))) for i in range(len(header))]

    def line(row: Sequence[str]) -> str:
        padded = (
            text.rjust(width) if to_right else text.ljust(width)
            for text, width, to_right in zip(row, widths, right, strict=True)
        )
        return "| " + " | ".join(padded) + " |"

    rule = "|".join(
        "-" * (width + 1) + (":" if to_right else "-")
        for width, to_right in zip(widths, right, strict=True)
    )
    return "\n".join([line(header), f"|{rule}|", *map(line, rows)])


def markdown_rows(frame: pd.DataFrame) -> str:
    """A data frame as a Markdown table."""
    right = [kind.kind in "if" for kind in frame.dtypes]
    rows = [
        [_number(value) if isinstance(value, float) else escape(str(value)) for value in row]
        for row in frame.itertuples(index=False, name=None)
    ]
    return aligned([escape(str(name)) for name in frame.columns], rows, right)


def to_markdown(table: Table) -> str:
    """The table as a page: how its numbers were taken, then a section per family."""
    told = [f"{c.heading}: {c.definition}." for c in table.columns if c.shown]
    notes = [f"- {escape(note)}" for note in (*told, *table.notes)]
    lines = [f"# {escape(table.title)}", "", *notes, ""]
    for family in dict.fromkeys(block.family for block in table.blocks):
        lines += [f"## {'All families' if family == ALL else escape(family)}", ""]
        parts = [block for block in table.blocks if block.family == family]
        lines += [markdown_blocks(table, parts), ""]
    if not table.blocks:
        lines += [table.empty, ""]
    return "\n".join(lines)


def markdown_blocks(table: Table, blocks: Iterable[Block]) -> str:
    """Some blocks of a table, each under its plant and reference mode.

    The best of a block is bold; a dagger follows times that cannot be trusted.
    """
    columns = [table.columns[place] for place in table.shown]
    header = ["formulation", "solver", *(escape(column.heading) for column in columns)]
    right = [False, False, *(True for _ in columns)]
    parts = []
    for block in blocks:
        rows = [
            [
                escape(row.formulation),
                escape(row.solver),
                *map(_cell, columns, (row.cells[place] for place in table.shown)),
            ]
            for row in block.rows
        ]
        if block.setting:
            parts.append(f"{escape(block.setting)}:")
        parts.append(aligned(header, rows, right))
        if block.note:
            parts.append(escape(block.note))
    return "\n\n".join(parts) or table.empty


def _cell(column: Column, cell: TableCell) -> str:
    if cell.text:
        return escape(cell.text)
    if isnan(cell.value):
        return ""
    if column.count:
        return str(int(cell.value))
    text = _number(cell.value, column.most)
    if cell.best:
        text = f"**{text}**"
    if cell.has_interval:
        text += f" [{_number(cell.lower)}, {_number(cell.upper)}]"
    return text + "†" * cell.unstable


def _number(value: float, most: float = inf) -> str:
    return "" if isnan(value) else shown(value, most).replace("inf", "∞")
