"""Where the time of a control step goes, per formulation and solver."""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import COLOURS, WIDTH, save, short

PARTS: Final = MappingProxyType(
    {
        "kinematics_time_median_us": ("kinematics and tasks", "0.75"),
        "formulation_own_time_median_us": ("formulation", COLOURS[0]),
        "solver_core_time_median_us": ("solver: the library's call", COLOURS[1]),
        "solver_wrapper_time_median_us": ("solver: what wraps it", COLOURS[5]),
    }
)
"""Columns of the parts of a step, with name and colour."""

P99: Final = "formulation_time_p99_us"

WITHIN: Final = 8.0
"""Bars that differ by more than this factor do not share an axis: the short ones would vanish."""

BEYOND: Final = 2.0
"""A tick farther out than so many times the longest bar is written instead of drawn."""


def draw_time_split(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a stacked bar per formulation and solver, the fast ones on an axis of their own."""
    table = time_parts(ran)
    if table.empty:
        return []
    groups = _groups(table)
    counts = [len(group) for group in groups]
    figure, axes = plt.subplots(
        len(groups),
        1,
        figsize=(WIDTH, 0.7 + 0.45 * len(groups) + 0.17 * sum(counts)),
        height_ratios=[count + 0.8 for count in counts],
        squeeze=False,
    )
    for axis, group in zip(axes[:, 0], groups, strict=True):
        _bars(axis, group)
    axes[-1, 0].set_xlabel("time of one control step [us]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    handles, labels = [*handles[1:], handles[0]], [*labels[1:], labels[0]]  # the tick last
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    caption = (
        "Time of one control step, medians over the scenarios that were timed, one core, one "
        "thread; the tick is where the 99 % quantile of the law's call ends, its number where that "
        "is far out. Each block has an axis of its own. Compare ratios: absolute times belong to "
        "the machine in the manifest."
    )
    file = save(figure, target, "time_per_formulation_and_solver")
    return [Figure(file, caption, "Time of one control step, per formulation and solver")]


def time_parts(ran: pd.DataFrame) -> pd.DataFrame:
    """Medians over the timed scenarios of each formulation and solver [us], fast ones first."""
    timed = ran[ran["formulation_time_median_us"].notna()].drop_duplicates(
        ["contender", "scenario"]
    )
    medians = timed.groupby("contender", sort=False)[[*PARTS, P99]].median()
    totals = medians[list(PARTS)].sum(axis=1)
    return medians.loc[totals[totals > 0].sort_values(kind="stable").index]


def _groups(table: pd.DataFrame) -> list[pd.DataFrame]:
    """Rows, ascending, in blocks that can share an axis."""
    totals = table[list(PARTS)].sum(axis=1).to_numpy()
    starts = [0]
    for index, total in enumerate(totals):
        if total > WITHIN * totals[starts[-1]]:
            starts.append(index)
    return [table.iloc[a:b] for a, b in zip(starts, [*starts[1:], len(table)], strict=True)]


def _bars(axis: Any, group: pd.DataFrame) -> None:
    places = np.arange(len(group))[::-1]
    left = np.zeros(len(group))
    for column, (name, colour) in PARTS.items():
        widths = group[column].fillna(0.0).to_numpy()
        axis.barh(places, widths, left=left, height=0.72, color=colour, label=name)
        left += widths
    ends = (group["kinematics_time_median_us"].fillna(0.0) + group[P99]).to_numpy()
    limit = max(float(left.max()), float(ends[ends <= BEYOND * left.max()].max(initial=0.0)))
    drawn = ends <= limit
    axis.plot(
        ends[drawn], places[drawn], "k|", markersize=8, markeredgewidth=1.3, label="99 % quantile"
    )
    for end, place in zip(ends[~drawn], places[~drawn], strict=True):
        if np.isfinite(end):
            axis.text(limit * 1.02, place, f"{end:.0f}", ha="left", va="center", fontsize=6)
    axis.set_yticks(places, [short(str(contender), 30) for contender in group.index])
    axis.set_ylim(-0.6, len(group) - 0.4)
    axis.set_xlim(0.0, 1.08 * limit)
    axis.grid(visible=False, axis="y")
