"""Grids of near misses in a table of trials: miss distance x speed past one singularity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.report.selection.rows import one_way
from dikbench.report.selection.sweeps import number
from dikbench.selector import parse_selector

FAMILY = "near-miss"


@dataclass(frozen=True, eq=False)
class NearMissGrid:
    """Trials of near misses that differ in miss distance, speed and formulation.

    Attributes:
        others: the other parameters of the scenarios, as in a selector.
        misses: miss distances [m; rad], ascending.
        speeds: ascending [rad/s; m/s].
        rows: the trials, with columns `miss` and `speed`.
    """

    others: str
    misses: tuple[float, ...]
    speeds: tuple[float, ...]
    rows: pd.DataFrame

    def values(self, column: str, over_seeds: Literal["median", "max"]) -> dict[str, Array]:
        """A column over the grid, (speeds, misses), per formulation.

        NaN where there was no trial, or none gave a number.
        """
        cells = self.rows.groupby(["formulation", "speed", "miss"], sort=False)[column]
        taken = cells.agg(over_seeds)
        return {
            str(name): (
                taken.loc[name]
                .unstack("miss")
                .reindex(index=list(self.speeds), columns=list(self.misses))
                .to_numpy(dtype=float)
            )
            for name in dict.fromkeys(self.rows["formulation"])
        }


def near_miss_grids(ran: pd.DataFrame) -> list[NearMissGrid]:
    """Every grid of at least two miss distances and two speeds."""
    chosen = one_way(ran)
    groups: dict[str, dict[str, tuple[float, float]]] = {}
    for scenario in dict.fromkeys(chosen["scenario"]):
        selector = parse_selector(scenario)
        miss = number(selector.parameters.get("miss", ""))
        speed = number(selector.parameters.get("speed", ""))
        if selector.name == FAMILY and miss is not None and speed is not None:
            rest = {k: v for k, v in selector.parameters.items() if k not in {"miss", "speed"}}
            key = ",".join(f"{name}={value}" for name, value in rest.items())
            groups.setdefault(key, {})[scenario] = (miss, speed)
    found = []
    for others, cells in groups.items():
        misses, speeds = (
            tuple(sorted(set(values))) for values in zip(*cells.values(), strict=True)
        )
        if min(len(misses), len(speeds)) >= 2:
            rows = chosen[chosen["scenario"].isin(cells)]
            place = np.array([cells[scenario] for scenario in rows["scenario"]])
            rows = rows.assign(miss=place[:, 0], speed=place[:, 1])
            found.append(NearMissGrid(others, misses, speeds, rows))
    return found
