"""Success against what it costs: time on the path, and time of a call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import COLOURS, WIDTH, logarithmic, save, short
from dikbench.report.selection.judged import judged_rows
from dikbench.report.selection.rows import names_of_contenders
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.first_places import BROKEN
from dikbench.statistics.stability import STABLE
from dikbench.statistics.success import rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER


def draw_success_against_slow_down(trials: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a point per formulation and solver: success, and how much slower it is for that.

    Args:
        trials: the rows of trials.csv.
        target: the folder of figures.
    """
    table = success_points(trials)
    table = table[table["slow_down"].notna()]
    if table.empty:
        return []
    figure, axis = plt.subplots(figsize=(WIDTH, 4.2))
    _points(axis, table, "slow_down")
    axis.set_xlabel("duration over the nominal one, where it succeeds")
    _finish(figure, axis, table, "slow_down")
    nameless = _labels(axis, table, "slow_down")
    caption = (
        "Success over all situations where the path may wait (families weighed equally) against "
        "the time that it takes: geometric mean of the duration over the nominal one, over the "
        "trials that succeed. Best is the upper left corner. Hollow: breaks limits, collides or "
        f"breaks off in some trial that counts, of whatever it is told.{nameless}"
    )
    file = save(figure, target, "success_against_slow_down")
    return [Figure(file, caption, "Success against slow-down")]


def draw_success_against_time(trials: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a point per formulation and solver: success, and the time of a call.

    Args:
        trials: the rows of trials.csv.
        target: the folder of figures.
    """
    table = success_points(trials)
    table = table[table["time"].notna()]
    if table.empty:
        return []
    figure, axis = plt.subplots(figsize=(WIDTH, 4.2))
    _points(axis, table, "time")
    logarithmic(axis, "x")
    axis.set_xlabel("99 % quantile of the time of one call [ms]")
    _finish(figure, axis, table, "time")
    nameless = _labels(axis, table, "time")
    unstable = int((~table["stable"]).sum())
    caption = (
        "Success over all situations where the path may wait (families weighed equally) against "
        "the median 99 % quantile of the time of one call, over the scenarios that were timed. "
        "Best is the upper left corner. Hollow: breaks limits, collides or breaks off in some "
        f"trial that counts. Times of {unstable} of {len(table)} points are not stable.{nameless}"
    )
    file = save(figure, target, "success_against_time")
    return [Figure(file, caption, "Success against the time of a call")]


def success_points(trials: pd.DataFrame) -> pd.DataFrame:
    """Compute per formulation and solver `success` [%], `slow_down`, `time` [ms], `stopped`."""
    rows = judged_rows(trials, "path")
    rows = rows[~rows["formulation"].isin(ORACLES)]
    if rows.empty:
        return pd.DataFrame(columns=["success", "slow_down", "time", "stopped", "stable"])
    found = rates(rows, succeeded(rows))
    done = rows["slow_down"].where(succeeded(rows))
    keys = [rows[name] for name in CONTENDER]
    slow_down = np.exp(np.log(done.replace(np.inf, np.nan)).groupby(keys, sort=False).mean())
    stopped = rows["outcome"].isin(BROKEN).groupby(keys, sort=False).any()
    cells = trials.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["formulation_time_p99_us"].notna()]
    own = [cells[name] for name in CONTENDER]
    time = cells["formulation_time_p99_us"].groupby(own, sort=False).median() / 1e3
    stable = cells["timing_stability"].eq(STABLE).groupby(own, sort=False).mean() > 0.5
    names, called = (
        list(found.contenders.itertuples(index=False, name=None)),
        names_of_contenders(rows),
    )
    return pd.DataFrame(
        {
            "success": 100 * found.rate,
            "slow_down": slow_down.reindex(names).to_numpy(),
            "time": time.reindex(names).to_numpy(dtype=float),
            "stopped": stopped.reindex(names).to_numpy(),
            "stable": [bool(stable.get(name, True)) for name in names],
        },
        index=[called[name] for name in names],
    )


def _points(axis: Any, table: pd.DataFrame, across: str) -> None:
    for part, fill, colour, label in (
        (table[~table["stopped"].astype(bool)], COLOURS[0], COLOURS[0], "keeps every limit"),
        (table[table["stopped"].astype(bool)], "white", COLOURS[1], "is stopped somewhere"),
    ):
        if len(part):
            axis.scatter(
                part[across], part["success"], s=20, facecolors=fill, edgecolors=colour,
                label=label, zorder=3,
            )  # fmt: skip


def _finish(figure: Any, axis: Any, table: pd.DataFrame, across: str) -> None:
    axis.set_ylabel("success [%]")
    axis.set_ylim(-4, 104)
    low, high = float(table[across].min()), float(table[across].max())
    if across == "time":
        axis.set_xlim(low / 1.8, high * 1.8)
    else:
        room = 0.15 * max(high - low, 0.1)
        axis.set_xlim(low - room, high + room)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center", ncols=2)


def _labels(axis: Any, table: pd.DataFrame, across: str) -> str:
    colours = [COLOURS[1] if stopped else COLOURS[0] for stopped in table["stopped"]]
    names = [short(str(name)) for name in table.index]
    return label_points(axis, table[[across, "success"]].to_numpy(dtype=float), names, colours)
