"""Success against what it costs: time on the path, and time of a call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import COLOURS, WIDTH, logarithmic, save, short
from dikbench.report.selection.judged import judged_rows
from dikbench.report.selection.rows import names_of_contenders
from dikbench.report.sentences.words import several
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.first_places import BROKEN, FEWEST_SCENARIOS
from dikbench.statistics.stability import STABLE
from dikbench.statistics.success import rates, succeeded
from dikbench.statistics.trial_matrix import CONTENDER, TrialMatrix


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
    over = _over(table, "slow_down_cases", "slow_down_same", "case", "did", "did")
    axis.set_xlabel(f"duration over the nominal one, {over.partition(' (')[0]}")
    _finish(figure, axis, table, "slow_down")
    nameless = _labels(axis, table, "slow_down")
    caption = (
        "Success over all situations where the path may wait (families weighed equally) against "
        "the time that it takes: geometric mean of the duration over the nominal one, "
        f"{over}. Best is the upper left corner. Hollow: breaks limits, collides or "
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
    over = _over(table, "time_scenarios", "time_same", "scenario", "were timed on", "was timed on")
    caption = (
        "Success over all situations where the path may wait (families weighed equally) against "
        f"the median 99 % quantile of the time of one call, {over}. "
        "Best is the upper left corner. Hollow: breaks limits, collides or breaks off in some "
        f"trial that counts. Times of {unstable} of {len(table)} points are not stable.{nameless}"
    )
    file = save(figure, target, "success_against_time")
    return [Figure(file, caption, "Success against the time of a call")]


def success_points(trials: pd.DataFrame) -> pd.DataFrame:
    """Compute per formulation and solver `success` [%], `slow_down`, `time` [ms], `stopped`.

    Durations are over the cases that all did that did any, and times over the scenarios that all
    were timed on that were on any; where these are of fewer than `FEWEST_SCENARIOS` scenarios,
    each is over its own. `slow_down_cases` and `time_scenarios` count them, `slow_down_same` and
    `time_same` say whether they are the same for all.
    """
    rows = judged_rows(trials, "path")
    rows = rows[~rows["formulation"].isin(ORACLES)]
    if rows.empty:
        return pd.DataFrame(columns=["success", "slow_down", "time", "stopped", "stable"])
    found = rates(rows, succeeded(rows))
    names = list(found.contenders.itertuples(index=False, name=None))
    done = rows["slow_down"].where(succeeded(rows)).replace(np.inf, np.nan)
    durations = found.layout.fill(np.log(done.to_numpy(dtype=float)))
    durations, same_cases = _in_common(durations, found.layout.cases["scenario"])
    keys = [rows[name] for name in CONTENDER]
    stopped = rows["outcome"].isin(BROKEN).groupby(keys, sort=False).any()
    cells = trials.drop_duplicates([*CONTENDER, "scenario"])
    cells = cells[cells["formulation_time_p99_us"].notna()]
    own = [cells[name] for name in CONTENDER]
    of_cells = TrialMatrix.of(cells[["scenario", *CONTENDER]])
    times = of_cells.fill(cells["formulation_time_p99_us"].to_numpy(dtype=float) / 1e3)
    times, same_scenarios = _in_common(times, of_cells.cases["scenario"])
    timed = list(of_cells.contenders.itertuples(index=False, name=None))
    columns = [timed.index(name) if name in timed else -1 for name in names]
    times = np.column_stack([times, np.full(len(times), np.nan)])[:, columns]
    stable = cells["timing_stability"].eq(STABLE).groupby(own, sort=False).mean() > 0.5
    called = names_of_contenders(rows)
    return pd.DataFrame(
        {
            "success": 100 * found.rate,
            "slow_down": np.exp(pd.DataFrame(durations).mean().to_numpy()),
            "slow_down_cases": (~np.isnan(durations)).sum(axis=0),
            "slow_down_same": same_cases,
            "time": pd.DataFrame(times).median().to_numpy(),
            "time_scenarios": (~np.isnan(times)).sum(axis=0),
            "time_same": same_scenarios,
            "stopped": stopped.reindex(names).to_numpy(),
            "stable": [bool(stable.get(name, True)) for name in names],
        },
        index=[called[name] for name in names],
    )


def _in_common(values: Array, scenarios: pd.Series) -> tuple[Array, bool]:
    """Keep the rows in which every column has a number that has any, and say so, if not too few.

    Args:
        values: (n, k).
        scenarios: of each row, (n,).
    """
    there = ~np.isnan(values)
    common: Mask = np.asarray(there[:, there.any(axis=0)].all(axis=1))
    if scenarios[common].nunique() < FEWEST_SCENARIOS:
        return values, False
    return np.where(common[:, None], values, np.nan), True


def _over(table: pd.DataFrame, count: str, same: str, what: str, did: str, it_did: str) -> str:
    """Say over how many cases, or the like, the points of a figure are."""
    least, most = int(table[count].min()), int(table[count].max())
    many = f"{least} to {most}" if least < most else str(most)
    if table[same].all():
        return f"over the {several(most, what)} that all of them {did}"
    return (
        f"each over the {what}s that it {it_did} itself ({many}: those that all of them "
        f"{did} are of fewer than {FEWEST_SCENARIOS} scenarios, so that points side by side are of "
        f"different {what}s)"
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
