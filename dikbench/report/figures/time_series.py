"""Errors and joint speed against time for the runs of one scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.metrics import Motion
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import WIDTH, logarithmic, look, save, short
from dikbench.report.selection.rows import LEAST_ERROR, how, one_way
from dikbench.report.selection.stored_motions import (
    in_panels,
    points_per_curve,
    stored_motions,
    thinned,
)
from dikbench.results.folder import ResultsFolder

POSITION, CONTOUR = "position error [mm]", "contour error [mm]"
SPEED = "largest joint speed over limit"

LEAST = {POSITION: 1e3 * LEAST_ERROR, CONTOUR: 1e3 * LEAST_ERROR, SPEED: 1e-2}
"""Nothing below this is drawn: the axes are logarithmic."""


def draw_time_series(
    folder: ResultsFolder, ran: pd.DataFrame, scenario: str, target: Path
) -> list[Figure]:
    """Draw the stored traces of one scenario, a row of panels for every few formulations."""
    motions = stored_motions(folder, ran, scenario)
    if not motions:
        return []
    columns = _columns(motions)
    rows = in_panels(list(motions))
    figure, axes = plt.subplots(
        len(rows),
        len(columns),
        figsize=(WIDTH, 0.7 + 1.35 * max(len(rows), 1.5)),
        sharex=True,
        sharey="col",
        squeeze=False,
    )
    most = points_per_curve(len(motions) * len(columns))
    for line, names in zip(axes, rows, strict=True):
        for axis, (label, values) in zip(line, columns.items(), strict=True):
            for number, name in enumerate(names):
                time, curve = thinned(values[name], motions[name].trace.dt, most)
                axis.plot(
                    time, np.maximum(curve, LEAST[label]), label=short(name, 22), **look(number)
                )
        line[-1].axhline(1.0, color="0.4", linewidth=0.7, zorder=1)
        line[-1].legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    for axis, label in zip(axes[0], columns, strict=True):
        axis.set_title(label)
    for axis in axes[0]:
        logarithmic(axis, "y")  # those below share it
    figure.supxlabel("time [s]", fontsize=8)
    file = save(figure, target, "error_and_speed_against_time")
    shown = one_way(ran[ran["scenario"].eq(scenario)])
    caption = (
        f"{'; '.join(label[0].upper() + label[1:] for label in columns)} against time: {scenario}, "
        f"{how(shown)}, one solver per law, from the best outcome to the worst, by the error "
        "within each."
    )
    return [Figure(file, caption, "Error and joint speed against time")]


def _columns(motions: Mapping[str, Motion]) -> dict[str, dict[str, Array]]:
    """What is drawn, with its label: the values of each formulation."""
    columns = {
        POSITION: {name: 1e3 * motion.position_error for name, motion in motions.items()},
        CONTOUR: {name: 1e3 * motion.contour_error for name, motion in motions.items()},
        SPEED: {name: _speed_ratio(motion) for name, motion in motions.items()},
    }
    same = all(
        np.array_equal(columns[POSITION][name], columns[CONTOUR][name], equal_nan=True)
        for name in motions
    )
    if same:  # there is no path
        del columns[CONTOUR]
    return columns


def _speed_ratio(motion: Motion) -> Array:
    limit, applied = motion.scenario.robot.limits.velocity, motion.trace.applied
    if limit is None:
        return np.full(len(applied), np.nan)
    ratio: Array = limit.usage(applied).max(axis=1)
    return ratio
