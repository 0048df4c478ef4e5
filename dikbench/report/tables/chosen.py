"""A table for a paper: some of its columns and formulations, under names of one's own."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import msgspec

from dikbench.errors import DikbenchError, unknown
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.every import make_tables
from dikbench.report.tables.latex_table import to_latex
from dikbench.report.tables.markdown import markdown_blocks
from dikbench.report.tables.table import Block, Table, TableRow
from dikbench.results.reading import read_results, without_attributes

Format = Literal["latex", "markdown", "csv"]


@dataclass(frozen=True)
class DisplayNames:
    """How formulations, solvers and columns are called in a paper.

    Attributes:
        formulations: name of a selector.
        solvers: name of a selector.
        columns: heading of a column, by its key in CSV.
    """

    formulations: Mapping[str, str] = field(default_factory=dict)
    solvers: Mapping[str, str] = field(default_factory=dict)
    columns: Mapping[str, str] = field(default_factory=dict)


def chosen_table(
    folder: Path,
    name: str,
    columns: Sequence[str] = (),
    formulations: Sequence[str] = (),
    names: DisplayNames | None = None,
) -> Table:
    """Make a table over all families from a results folder.

    Args:
        folder: the results.
        name: of the table.
        columns: keys or headings of the columns, in the order wanted; default: those shown.
        formulations: selectors, in the order wanted; default: all.
        names: how they are called; default: as they are.

    Raises:
        DikbenchError: if the folder holds no results, or a name is unknown.
    """
    trials = without_attributes(read_results(folder, lenient=True)).trials
    tables = {table.name: table for table in make_tables(trials)}
    if name not in tables:
        raise unknown("table", name, list(tables))
    table = replace(tables[name], blocks=tables[name].overall)
    return _renamed(_chosen(table, columns, formulations), names or DisplayNames())


def read_display_names(file: Path) -> DisplayNames:
    """Read display names from a TOML file with tables [formulations], [solvers], [columns].

    Raises:
        DikbenchError: if the file cannot be read, or holds anything else.
    """
    try:
        found = tomllib.loads(file.read_text(encoding="utf-8"))
        if unknown_tables := found.keys() - DisplayNames.__dataclass_fields__.keys():
            raise ValueError(f"unknown table {min(unknown_tables)!r}")
        return msgspec.convert(found, DisplayNames, strict=True)
    except (OSError, ValueError, msgspec.ValidationError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise DikbenchError(
            f"display names in {file}: {reason}; valid: tables [formulations], [solvers] and "
            "[columns] of texts"
        ) from None


def written(table: Table, form: Format) -> str:
    """Write a table in a format; LaTeX is as wide as a column of a two-column paper."""
    if form == "csv":
        return to_csv(table)
    return to_latex(table) if form == "latex" else markdown_blocks(table, table.blocks) + "\n"


def _chosen(table: Table, columns: Sequence[str], formulations: Sequence[str]) -> Table:
    """Select columns and rows, in the order wanted."""
    of = {c.heading: place for place, c in enumerate(table.columns)}
    of |= {c.key: place for place, c in enumerate(table.columns)}
    for column in columns:
        if column not in of:
            raise unknown("column", column, [c.key for c in table.columns])
    places = [of[column] for column in columns] or list(range(len(table.columns)))
    every = {row.formulation: None for block in table.blocks for row in block.rows}
    if formulations and not every:
        raise DikbenchError(f"the table {table.name} has no rows: {table.empty}")
    for formulation in formulations:
        if formulation not in every:
            raise unknown("formulation", formulation, list(every))
    wanted = list(formulations or every)

    def rows(block: Block) -> tuple[TableRow, ...]:
        return tuple(
            replace(row, cells=tuple(row.cells[place] for place in places))
            for name in wanted
            for row in block.rows
            if row.formulation == name
        )

    picked = [table.columns[place] for place in places]
    return replace(
        table,
        columns=tuple(replace(column, shown=True) for column in picked) if columns else (*picked,),
        blocks=tuple(replace(block, rows=rows(block)) for block in table.blocks),
    )


def _renamed(table: Table, names: DisplayNames) -> Table:
    """Call formulations, solvers and columns by their display names."""
    return replace(
        table,
        columns=tuple(
            replace(column, heading=names.columns[column.key], short="")
            if column.key in names.columns
            else column
            for column in table.columns
        ),
        blocks=tuple(
            replace(
                block,
                rows=tuple(
                    replace(
                        row,
                        formulation=names.formulations.get(row.formulation, row.formulation),
                        solver=names.solvers.get(row.solver, row.solver),
                    )
                    for row in block.rows
                ),
            )
            for block in table.blocks
        ),
    )
