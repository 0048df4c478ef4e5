"""Off course against slow-down: the two ways not to do what was asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.arrays import Array, Mask
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import COLOURS, WIDTH, save, short
from dikbench.report.selection.rows import how

DIGITS: Final = 3
"""After the point, of deg and %; beyond these a formulation is not better, it is rounded
otherwise."""


def draw_off_course_and_slow_down(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a point per formulation and the formulations that none beats in both, for each plant."""
    ways = ran.groupby(["plant", "reference"], sort=False)
    parts = [rows for _, rows in ways if rows["status"].eq("ok").any()]
    tables = {how(rows): table for rows in parts if len(table := contender_points(rows))}
    if not tables:
        return []
    height = 3.5 if len(tables) <= 2 else 2.8
    figure, axes = plt.subplots(
        len(tables), 1, figsize=(WIDTH, height * len(tables)), squeeze=False
    )
    for axis, (name, table) in zip(axes.flat, tables.items(), strict=True):
        _draw(axis, table)
        axis.set_title(name)
    axes[-1, 0].set_xlabel("mean slow-down [%]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    nameless = ""
    for axis, table in zip(axes.flat, tables.values(), strict=True):
        colours = [COLOURS[1] if violating else COLOURS[0] for violating in table["violating"]]
        names = [short(str(name)) for name in table.index]
        nameless += label_points(
            axis, table[["slow_down", "off_course"]].to_numpy(), names, colours
        )
    caption = (
        "Largest angle off the wanted direction against the share of the wanted motion that was "
        "not made, means over the scenarios, a point per law (first of its solvers); a failed "
        "trial counts as 180 deg and 100 %. Best is the lower left corner. The line joins the laws "
        "that keep the limits in every trial and that no other such law beats in both; a law that "
        f"passes a limit is hollow.{nameless}"
    )
    file = save(figure, target, "off_course_against_slow_down")
    return [Figure(file, caption, "Off course against slow-down")]


def contender_points(rows: pd.DataFrame) -> pd.DataFrame:
    """The means of each formulation: `off_course` [deg], `slow_down` [%], and `violating`."""
    ended = rows["status"].eq("ok")
    off_course = np.degrees(rows["direction_error_max_rad"]).where(ended, 180.0)
    slow_down = (100.0 * (1.0 - rows["progress_mean"])).clip(0.0, 100.0).where(ended, 100.0)
    table = pd.DataFrame(
        {
            "formulation": rows["formulation"],
            "off_course": off_course,
            "slow_down": slow_down,
            "violating": rows["violating_share"].gt(0.0),
        }
    )
    by_formulation = table.groupby("formulation", sort=False)
    means = by_formulation[["off_course", "slow_down"]].mean()
    return means.assign(violating=by_formulation["violating"].any()).dropna()


def front(points: Array) -> Mask:
    """Which of the points (k, 2) no other one beats: none is as small in both, smaller in one."""
    no_larger = np.all(points[:, None] <= points[None], axis=2)
    smaller = np.any(points[:, None] < points[None], axis=2)
    best: Mask = ~np.any(no_larger & smaller, axis=0)
    return best


def _draw(axis: Any, table: pd.DataFrame) -> None:
    keeping = table[~table["violating"]]
    passing = table[table["violating"]]
    best = keeping[front(keeping[["slow_down", "off_course"]].round(DIGITS).to_numpy())]
    best = best.sort_values(["slow_down", "off_course"], ascending=[True, False])
    axis.plot(
        best["slow_down"], best["off_course"], color="0.6", drawstyle="steps-post",
        label="none that keeps the limits is better in both", zorder=1,
    )  # fmt: skip
    axis.scatter(
        keeping["slow_down"], keeping["off_course"], s=18, color=COLOURS[0],
        label="keeps the limits", zorder=3,
    )  # fmt: skip
    axis.scatter(
        passing["slow_down"], passing["off_course"], s=18, facecolors="white",
        edgecolors=COLOURS[1], label="passes a limit somewhere", zorder=3,
    )  # fmt: skip
    axis.set_ylabel("mean of the largest\nangle off course [deg]")
    right = 1.1 * max(float(table["slow_down"].max()), 10.0)
    top = 1.15 * max(float(table["off_course"].max()), 10.0)
    axis.set_xlim(-0.04 * right, right)
    axis.set_ylim(-0.06 * top, top)
