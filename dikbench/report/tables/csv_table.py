"""A table as CSV: plain numbers in full, and the bounds of intervals."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from dikbench.report.tables.table import Column, Table, TableCell


def to_csv(table: Table) -> str:
    """A row per block, formulation and solver; what was not measured is empty, infinity `inf`."""
    keys = ["family", *_setting(table), "formulation", "solver"]
    numbers = [name for column in table.columns for name, _ in _numbers(column, TableCell(0.0))]
    rows = [
        [
            block.family,
            *(getattr(block, name) for name in _setting(table)),
            row.formulation,
            row.solver,
            *(
                number
                for column, cell in zip(table.columns, row.cells, strict=True)
                for _, number in _numbers(column, cell)
            ),
        ]
        for block in table.blocks
        for row in block.rows
    ]
    return pd.DataFrame(rows, columns=[*keys, *numbers], dtype=object).to_csv(index=False)


def _setting(table: Table) -> list[str]:
    """The columns that tell plants and reference modes apart, where the table does."""
    return ["plant", "reference"] if any(block.plant for block in table.blocks) else []


def _numbers(column: Column, cell: TableCell) -> Iterator[tuple[str, float | int | str]]:
    if column.count:
        yield column.key, int(cell.value)
        return
    yield column.key, cell.text or cell.value
    if column.interval:
        yield f"{column.key}_lower", cell.lower
        yield f"{column.key}_upper", cell.upper
