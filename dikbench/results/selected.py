"""The parts of the selectors in a table of results, as columns of their own."""

from __future__ import annotations

from typing import Any

import pandas as pd

from dikbench.metrics import METRICS
from dikbench.results.columns import DESCRIBED, SELECTORS
from dikbench.selector import parse_selector


def with_selected(rows: pd.DataFrame) -> pd.DataFrame:
    """Add a column for the name and for each parameter of what is selected.

    These are `formulation_name`, `formulation_damping`, `scenario_family`, `scenario_miss`, ...:
    numbers where all values of a parameter are numbers, missing where a selector does not name it.

    Raises:
        DikbenchError: if a text is no selector.
    """
    for column, head in SELECTORS.items():
        if column not in rows:
            continue
        parsed = {text: parse_selector(text) for text in rows[column].unique()}
        table = pd.DataFrame(
            [{head: selector.name, **selector.parameters} for selector in parsed.values()],
            index=pd.Index(list(parsed), dtype=object),
            columns=list(
                dict.fromkeys([head, *(key for s in parsed.values() for key in s.parameters)])
            ),
        )
        for name in table.columns[1:]:
            try:
                table[name] = pd.to_numeric(table[name])
            except ValueError:
                continue
        parts = table.add_prefix(f"{column}_")
        parts = parts[parts.columns.difference(rows.columns, sort=False)]
        rows = rows.join(parts, on=column)
    return rows


def selected_columns(rows: pd.DataFrame, column: str) -> dict[str, str]:
    """Return the parameters of what a column selects, each with the column that holds its values.

    Args:
        rows: results (see `with_selected`).
        column: one of `SELECTORS`.
    """
    prefix = f"{column}_"
    known = {*METRICS, *DESCRIBED, f"{prefix}{SELECTORS[column]}"}
    return {
        name.removeprefix(prefix): name
        for name in map(str, rows.columns)
        if name.startswith(prefix) and name not in known
    }


def parameters_of(rows: pd.DataFrame, column: str) -> dict[str, dict[str, Any]]:
    """Return the parameters that each selector of a column names, with their values.

    Args:
        rows: results (see `with_selected`).
        column: one of `SELECTORS`.
    """
    columns = selected_columns(rows, column)
    each = rows.drop_duplicates(column).set_index(column)
    return {
        str(text): {
            name: _plain(values[of]) for name, of in columns.items() if pd.notna(values[of])
        }
        for text, values in each[list(columns.values())].iterrows()
    }


def _plain(value: Any) -> Any:
    """Return a value; a whole number that a column with gaps holds as a float is one again."""
    return int(value) if isinstance(value, float) and value.is_integer() else value
