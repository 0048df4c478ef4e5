"""The figures of a report, each made from the results folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.report.figure import Figure
from dikbench.report.style import law_name, look, marker, names_in_order, save, style
from dikbench.report.sweeps import Sweep, sweeps
from dikbench.report.time_series import draw_time_series
from dikbench.run.results import ResultsFolder


def draw_figures(
    folder: ResultsFolder, trials: pd.DataFrame, manifest: Mapping[str, Any]
) -> list[Figure]:
    """Draw every figure for which the results have data.

    Args:
        folder: the results folder; figures go to `figures/`.
        trials: the rows of trials.csv.
        manifest: the manifest.
    """
    target = folder.path / "figures"
    target.mkdir(exist_ok=True)
    ran = trials[trials["status"].ne("skipped") & trials["steps"].gt(0)].copy()
    ran["law"] = [law_name(f, s) for f, s in zip(ran["formulation"], ran["solver"], strict=True)]
    figures: list[Figure] = []
    if ran.empty:
        return figures
    with style():
        example = manifest["study"].get("example") or ran["scenario"].iloc[0]
        drawn = draw_time_series(folder, one_solver_each(ran), example, target)
        if drawn:
            figures.append(
                Figure(
                    drawn,
                    "Position error and largest joint speed over its limit against time, "
                    f"{example}, ideal plant, one solver per law.",
                )
            )
        figures.append(_off_course_against_progress(ran, target))
        figures += [_sweep(sweep, target) for sweep in sweeps(one_solver_each(ran))]
        if ran["law_time_median_us"].notna().any():
            figures.append(_times(ran, target))
    return figures


def one_solver_each(ran: pd.DataFrame) -> pd.DataFrame:
    """The rows of each formulation with the first of its solvers: curves that would coincide."""
    first = ran.groupby("formulation", sort=False)["solver"].transform("first")
    return ran[ran["solver"] == first]


def _off_course_against_progress(ran: pd.DataFrame, target: Path) -> Figure:
    rows = one_solver_each(ran)
    plants = names_in_order(list(rows["plant"]))
    figure, axes = plt.subplots(
        1, len(plants), figsize=(4.2 * len(plants), 3.6), squeeze=False, sharex=True, sharey=True
    )
    for axis, plant in zip(axes[0], plants, strict=True):
        for number, name in enumerate(names_in_order(list(rows["formulation"]))):
            points = rows[(rows["plant"] == plant) & (rows["formulation"] == name)]
            axis.scatter(
                points["progress_mean"],
                np.degrees(points["off_course_max_rad"]),
                s=26,
                alpha=0.75,
                linewidths=0,
                label=name,
                **marker(number),
            )
        axis.set_title(f"{plant} plant")
        axis.set_xlabel("mean progress")
        axis.set_ylim(-5, 185)
        axis.set_yticks(range(0, 181, 45))
    axes[0][0].set_ylabel("largest off course [deg]")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside right upper")
    caption = (
        "Off course against progress, a point per scenario: leaving the course and slowing down "
        "are different failures. Best is the lower right corner."
    )
    return Figure(save(figure, target, "off_course_against_progress"), caption)


def _sweep(sweep: Sweep, target: Path) -> Figure:
    metrics: Mapping[str, str] = MappingProxyType(
        {
            "position_error_max_m": "largest position error [m]",
            "velocity_peak_ratio": "peak speed over limit",
        }
    )
    figure, axes = plt.subplots(1, len(metrics), figsize=(8.2, 3.4))
    for axis, (metric, label) in zip(axes, metrics.items(), strict=True):
        for number, (name, points) in enumerate(sweep.rows.groupby("formulation", sort=False)):
            ordered = points.sort_values("value")
            axis.plot(
                ordered["value"], np.maximum(ordered[metric], 1e-6), markersize=4,
                label=str(name), **{**look(number), **marker(number)},
            )  # fmt: skip
        axis.set_xlabel(f"{sweep.family}: {sweep.parameter}")
        axis.set_ylabel(label)
        axis.set_yscale("log")
        _scale_by_values(axis, sorted(set(sweep.rows["value"])))
    axes[1].axhline(1.0, color="0.5", linewidth=0.8)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside right upper")
    caption = (
        f"Largest position error and peak speed against {sweep.parameter} of {sweep.family} "
        f"({sweep.others or 'defaults'}), ideal plant."
    )
    file = save(figure, target, f"error_against_{sweep.parameter}_{sweep.number}")
    return Figure(file, caption)


def _scale_by_values(axis: Any, values: list[float]) -> None:
    """A tick at every value of a sweep; logarithmic where they span a decade, zero at the left."""
    positive = [value for value in values if value > 0]
    if positive[-1] / positive[0] >= 10:
        axis.set_xscale("symlog", linthresh=positive[0], linscale=0.5)
        axis.set_xlim(0.0 if values[0] == 0 else positive[0], 1.2 * positive[-1])
    axis.set_xticks(values, [f"{value:g}" for value in values])
    axis.minorticks_off()


def _times(ran: pd.DataFrame, target: Path) -> Figure:
    timed = ran.drop_duplicates(["law", "scenario"])
    medians = timed.groupby("law", sort=False)[
        [
            "law_time_median_us",
            "law_time_p99_us",
            "solver_core_time_median_us",
            "solver_wrapper_time_median_us",
        ]
    ].median()
    medians = medians.dropna(subset="law_time_median_us").sort_values("law_time_median_us")
    figure, axis = plt.subplots(figsize=(7.2, 0.6 + 0.27 * len(medians)))
    places = np.arange(len(medians))
    axis.hlines(
        places, medians["law_time_median_us"], medians["law_time_p99_us"], color="0.8", zorder=1
    )
    inside = medians["solver_core_time_median_us"] + medians["solver_wrapper_time_median_us"]
    solving = inside.where(inside > 0)
    axis.plot(solving, places, "D", color="#E69F00", label="of it, solver and its interface")
    axis.plot(medians["law_time_median_us"], places, "o", color="#0072B2", label="median")
    axis.plot(medians["law_time_p99_us"], places, "k|", markersize=8, label="99 % quantile")
    axis.set_yticks(places, list(medians.index))
    axis.set_xscale("log")
    axis.set_xlabel("time of one call [us], median over scenarios")
    axis.grid(visible=False, axis="y")
    axis.legend(loc="lower right")
    caption = (
        "Time of one call of each law and solver, one core, one thread. "
        "Compare ratios: absolute times belong to the machine in the manifest."
    )
    return Figure(save(figure, target, "time_per_law_and_solver"), caption)
