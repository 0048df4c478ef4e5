"""Error against the time of a call: what accuracy costs, per formulation and solver."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import COLOURS, WIDTH, logarithmic, save, short
from dikbench.report.selection.rows import (
    LEAST_ERROR,
    error_column,
    failures_at_infinity,
    how,
    one_way,
)
from dikbench.results.columns import TIMED
from dikbench.statistics.stability import STABLE

OUTER = 1.8
"""Factor by which the axes go beyond the points: room for names."""


def draw_error_and_time(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a point per formulation and solver, over the cells that were timed."""
    rows = one_way(ran)
    table = cost_points(rows)
    if table.empty:
        return []
    _, name = error_column(rows)
    figure, axis = plt.subplots(figsize=(WIDTH, 4.6))
    solving = table["solver"].ne("none")
    for group, colour, label in (
        (table[~solving], COLOURS[0], "closed form"),
        (table[solving], COLOURS[1], "with a solver"),
    ):
        for part, fill, stability in (
            (group[group["stable"]], colour, ""),
            (group[~group["stable"]], "white", ", timing not stable"),
        ):
            if len(part):
                axis.scatter(
                    part["time"], part["error"], s=20, facecolors=fill, edgecolors=colour,
                    label=label + stability, zorder=3,
                )  # fmt: skip
    logarithmic(axis, "x")
    logarithmic(axis, "y")
    axis.set_xlim(table["time"].min() / OUTER, table["time"].max() * OUTER)
    axis.set_ylim(table["error"].min() / OUTER, table["error"].max() * OUTER)
    axis.set_xlabel("99 % quantile of the time of one call [us]")
    axis.set_ylabel(f"rms {name} [mm]")
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    colours = [COLOURS[1] if with_solver else COLOURS[0] for with_solver in solving]
    points = table[["time", "error"]].to_numpy()
    nameless = label_points(
        axis, points, [short(str(contender)) for contender in table.index], colours
    )
    caption = (
        f"Median rms {name} against the median 99 % quantile of the time of one call, over the "
        f"scenarios that were timed, {how(rows)}, a point per law and solver. Best is the lower "
        "left corner. Laws that fail in half of them are left out. Compare ratios: absolute times "
        f"belong to the machine in the manifest.{nameless}"
    )
    file = save(figure, target, "error_against_time_per_formulation")
    return [Figure(file, caption, f"{name[0].upper()}{name[1:]} against time of a call")]


def cost_points(rows: pd.DataFrame) -> pd.DataFrame:
    """Medians over the timed cells of each law and solver: `time` [us], `error` [mm], `stable`."""
    column, _ = error_column(rows)
    cells = (
        rows.assign(error=(1e3 * failures_at_infinity(rows, column)))
        .groupby([*TIMED, "contender"], sort=False, dropna=False)
        .agg(
            error=("error", "median"),
            time=("formulation_time_p99_us", "first"),
            stability=("timing_stability", "first"),
        )
        .reset_index()
    )
    cells = cells[cells["time"].gt(0) & cells["error"].notna()]
    cells = cells.assign(stable=cells["stability"].eq(STABLE))
    table = cells.groupby("contender", sort=False).agg(
        solver=("solver", "first"),
        error=("error", "median"),
        time=("time", "median"),
        stable=("stable", "all"),
    )
    table = table[table["error"] < float("inf")]
    return table.assign(error=table["error"].clip(lower=1e3 * LEAST_ERROR))
