"""Grids in a table of trials: the two parameters of a family that span a phase diagram."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pandas as pd

from dikbench.arrays import Array
from dikbench.report.selection.declared import declared_family
from dikbench.report.selection.rows import one_way
from dikbench.report.selection.sweeps import number
from dikbench.results.selected import parameters_of
from dikbench.selector import listed


@dataclass(frozen=True, eq=False)
class PhaseGrid:
    """Trials of a family that differ in two parameters and in the formulation.

    Attributes:
        family: its name.
        across, up: the parameters.
        others: the other parameters of the scenarios, as in a selector.
        columns, lines: the values of `across` and of `up`, ascending.
        rows: the trials, with columns `across` and `up`.
    """

    family: str
    across: str
    up: str
    others: str
    columns: tuple[float, ...]
    lines: tuple[float, ...]
    rows: pd.DataFrame

    def values(self, column: str, over_seeds: Literal["median", "max"]) -> dict[str, Array]:
        """Take a column over the grid, (lines, columns), per formulation.

        NaN where there was no trial, or none gave a number.
        """
        cells = self.rows.groupby(["formulation", "up", "across"], sort=False)[column]
        taken = cells.agg(over_seeds)
        return {
            str(name): (
                taken.loc[name]
                .unstack("across")
                .reindex(index=list(self.lines), columns=list(self.columns))
                .to_numpy(dtype=float)
            )
            for name in dict.fromkeys(self.rows["formulation"])
        }


def phase_grids(ran: pd.DataFrame) -> list[PhaseGrid]:
    """Find every grid of at least two values of each of the parameters that a family declares."""
    chosen = one_way(ran)
    found = []
    for name, rows in chosen.groupby("scenario_family", sort=False):
        family = declared_family(str(name))
        if family is not None and family.grid is not None:
            found += _grids_of(str(name), *family.grid, rows)
    return found


def _grids_of(family: str, across: str, up: str, rows: pd.DataFrame) -> list[PhaseGrid]:
    groups: dict[str, dict[str, tuple[float, float]]] = {}
    for scenario, parameters in parameters_of(rows, "scenario").items():
        x, y = number(parameters.get(across)), number(parameters.get(up))
        if x is not None and y is not None:
            rest = {k: v for k, v in parameters.items() if k not in {across, up}}
            groups.setdefault(listed(rest), {})[scenario] = (x, y)
    found = []
    for others, cells in groups.items():
        columns, lines = (
            tuple(sorted(set(values))) for values in zip(*cells.values(), strict=True)
        )
        if min(len(columns), len(lines)) >= 2:
            part = rows[rows["scenario"].isin(cells)]
            places = [cells[scenario] for scenario in part["scenario"]]
            part = part.assign(across=[x for x, _ in places], up=[y for _, y in places])
            found.append(PhaseGrid(family, across, up, others, columns, lines, part))
    return found
