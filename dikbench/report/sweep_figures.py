"""Error and peak speed against a swept parameter: a panel for each law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps

from dikbench.report.figure import Figure
from dikbench.report.panels import small_multiples
from dikbench.report.rows import LEAST_ERROR, error_column, how, pages, ranked
from dikbench.report.style import COLOURS, file_name, logarithmic, save
from dikbench.report.sweeps import Sweep, sweeps
from dikbench.report.value_scale import ValueScale

PER_PAGE = 24
"""Laws in one figure."""

MOST_CURVES = 5
"""In a panel: of more values of the second parameter, so many are drawn, spread over all."""

UNITS = {
    "miss": " [m; rad]",
    "speed": "",
    "depth": " [rad]",
    "deceleration": " [rad/s^2]",
    "distance": " [m]",
    "angle": " [rad]",
    "outside": " [rad]",
    "gain": " [1/s]",
    "dt": " [s]",
}


@dataclass(frozen=True)
class _Quantity:
    """What is drawn against the parameter."""

    column: str
    name: str
    label: str
    scale: float
    least: float


def draw_sweeps(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw every sweep of a numeric parameter of the scenarios."""
    figures = []
    column, name = error_column(ran)
    quantities = (
        _Quantity(column, "error", f"rms {name} [mm]", 1e3, 1e3 * LEAST_ERROR),
        _Quantity("velocity_peak_ratio", "peak_speed", "peak speed over limit", 1.0, 1e-3),
    )
    for number, sweep in enumerate(sweeps(ran), start=1):
        for quantity in quantities:
            if not sweep.rows[quantity.column].where(sweep.rows["status"].eq("ok")).notna().any():
                continue
            parts = pages(ranked(sweep.rows, column), PER_PAGE)
            for page, laws in enumerate(parts, start=1):
                file = file_name(
                    quantity.name, "against", sweep.parameter, number, *[page] * (len(parts) > 1)
                )
                figures.append(
                    Figure(
                        _draw(sweep, quantity, laws, target, file),
                        _caption(sweep, quantity),
                        f"{quantity.label} against {sweep.parameter}: {sweep.family}",
                    )
                )
    return figures


def _caption(sweep: Sweep, quantity: _Quantity) -> str:
    curves = (
        f"a curve for each {sweep.second}"
        if sweep.second
        else "in grey the median law and the middle half of all laws"
    )
    return (
        f"{quantity.label[0].upper()}{quantity.label[1:]} against {sweep.parameter} of "
        f"{sweep.family} ({sweep.others or 'defaults'}), {how(sweep.rows)}, from the best law to "
        f"the worst by median error; {curves}. A cross at the top: the trial failed."
    )


def _draw(sweep: Sweep, quantity: _Quantity, laws: Sequence[str], target: Path, file: str) -> str:
    scale = ValueScale(sweep.rows["value"])
    worth = quantity.scale * sweep.rows[quantity.column].where(sweep.rows["status"].eq("ok"))
    rows = sweep.rows.assign(worth=worth.clip(lower=quantity.least))
    table = rows.groupby(["formulation", "second", "value"], sort=False)["worth"].median()
    x_label = f"{sweep.parameter}{UNITS.get(sweep.parameter, '')}"
    figure, axes = small_multiples(
        laws, 0.85, x_label, quantity.label, top=0.62 if sweep.second else 0.22
    )
    for axis, law in zip(axes, laws, strict=True):
        if not sweep.second:
            _others(axis, scale, table)
        for second, colour in _curves(rows["second"], bool(sweep.second)):
            curve = table.get(law, pd.Series(dtype=float)).get(second, pd.Series(dtype=float))
            curve = curve.sort_index()
            axis.plot(
                scale.place(curve.index), curve.to_numpy(), "o-", color=colour,
                markersize=2.5, linewidth=1.1, label=f"{second:g}",
            )  # fmt: skip
            broken = scale.place(curve.index[curve.isna()])
            top = np.full(len(broken), 0.97)
            transform = axis.get_xaxis_transform()
            axis.plot(broken, top, "x", color=colour, markersize=3, transform=transform)
        if quantity.name == "peak_speed":
            axis.axhline(1.0, color="0.4", linewidth=0.7, zorder=1)
    logarithmic(axes[0], "y")  # they share their axes
    scale.label(axes)
    if sweep.second:
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            title=f"{sweep.second}{UNITS.get(sweep.second, '')}",
            title_fontsize=7,
            loc="upper center",
            ncols=len(labels),
        )
    return save(figure, target, file)


def _curves(seconds: pd.Series, several: bool) -> list[tuple[float, Any]]:
    """The values of the second parameter that are drawn, each with its colour."""
    values = np.unique(seconds)
    if not several:
        return [(float(values[0]), COLOURS[0])]
    chosen = np.unique(np.linspace(0, len(values) - 1, MOST_CURVES).round().astype(int))
    shades = colormaps["viridis"](np.linspace(0.0, 0.85, len(chosen)))
    return [(float(values[index]), shade) for index, shade in zip(chosen, shades, strict=True)]


def _others(axis: Any, scale: ValueScale, table: pd.Series) -> None:
    """The median law and the middle half of all laws, in grey."""
    quartiles = table.groupby("value").quantile(np.array([0.25, 0.5, 0.75])).unstack().sort_index()
    places = scale.place(quartiles.index)
    axis.fill_between(places, quartiles[0.25], quartiles[0.75], color="0.87", linewidth=0)
    axis.plot(places, quartiles[0.5], color="0.65", linewidth=0.9)
