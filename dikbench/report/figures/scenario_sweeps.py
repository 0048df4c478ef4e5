"""Error and peak speed against a swept parameter: a panel for each formulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.panels import small_multiples
from dikbench.report.drawing.style import COLOURS, file_name, logarithmic, save, short
from dikbench.report.drawing.value_scale import ValueScale
from dikbench.report.selection.declared import with_unit
from dikbench.report.selection.rows import LEAST_ERROR, error_column, how, pages, ranked
from dikbench.report.selection.sweeps import Sweep, number, sweeps

PER_PAGE = 24
"""Formulations in one figure."""

MOST_CURVES = 5
"""In a panel: of more values of the second parameter, so many are drawn, spread over all."""


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
    for place, sweep in enumerate(sweeps(ran), start=1):
        for quantity in quantities:
            if not sweep.rows[quantity.column].where(sweep.rows["status"].eq("ok")).notna().any():
                continue
            parts = pages(ranked(sweep.rows, column), PER_PAGE)
            for page, formulations in enumerate(parts, start=1):
                file = file_name(
                    quantity.name, "against", sweep.parameter, place, *[page] * (len(parts) > 1)
                )
                figures.append(
                    Figure(
                        _draw(sweep, quantity, formulations, target, file),
                        _caption(sweep, quantity),
                        f"{quantity.label} against {sweep.parameter}: {sweep.family}",
                    )
                )
    return figures


def _caption(sweep: Sweep, quantity: _Quantity) -> str:
    curves = (
        f"a curve for each {sweep.second}"
        if sweep.second
        else "in grey the median formulation and the middle half of all formulations"
    )
    return (
        f"{quantity.label[0].upper()}{quantity.label[1:]} against {sweep.parameter} of "
        f"{sweep.family} ({sweep.others or 'defaults'}), {how(sweep.rows)}, medians over the "
        f"seeds, by outcome, then by median error; {curves}. A cross at the top: every seed failed."
    )


def _draw(
    sweep: Sweep, quantity: _Quantity, formulations: Sequence[str], target: Path, file: str
) -> str:
    scale = ValueScale(sweep.rows["value"])
    table = _table(sweep, quantity)
    x_label = with_unit(sweep.family, sweep.parameter)
    figure, axes = small_multiples(
        formulations, 0.85, x_label, quantity.label, top=0.62 if sweep.second else 0.22
    )
    for axis, formulation in zip(axes, formulations, strict=True):
        if not sweep.second:
            _others(axis, scale, table["worth"])
        of_formulation = table.loc[formulation]
        for second, colour in _curves(list(dict.fromkeys(sweep.rows["second"]))):
            curve = of_formulation[
                of_formulation.index.get_level_values("second") == second
            ].droplevel("second")
            axis.plot(
                *scale.curve(curve.index.to_numpy(), curve["worth"].to_numpy()), "o-",
                color=colour, markersize=2.5, linewidth=1.1, label=short(second),
            )  # fmt: skip
            failed = scale.place(curve.index[curve["failed"]])
            if len(failed):
                axis.plot(
                    failed, np.full(len(failed), 0.97), "x", color=colour, markersize=3,
                    transform=axis.get_xaxis_transform(),
                )  # fmt: skip
        if quantity.name == "peak_speed":
            axis.axhline(1.0, color="0.4", linewidth=0.7, zorder=1)
    logarithmic(axes[0], "y")  # they share their axes
    scale.label(axes)
    if sweep.second:
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            title=with_unit(sweep.family, sweep.second),
            title_fontsize=7,
            loc="upper center",
            ncols=len(labels),
        )
    return save(figure, target, file)


def _table(sweep: Sweep, quantity: _Quantity) -> pd.DataFrame:
    """Per law and place in the sweep: `worth`, the median over seeds, and whether all `failed`."""
    ended = sweep.rows["status"].eq("ok")
    worth = quantity.scale * sweep.rows[quantity.column].where(ended)
    rows = sweep.rows.assign(worth=worth.clip(lower=quantity.least), failed=~ended)
    cells = rows.groupby(["formulation", "second", "value"])
    return cells.agg(worth=("worth", "median"), failed=("failed", "all"))


def _curves(seconds: Sequence[str]) -> list[tuple[str, Any]]:
    """The values of the second parameter that are drawn, each with its colour.

    Numbers run from dark to light, names have colours of their own.
    """
    if len(seconds) == 1:
        return [(seconds[0], COLOURS[0])]
    numbers = [number(second) for second in seconds]
    in_order = list(seconds)
    if None not in numbers:
        in_order = [second for _, second in sorted(zip(numbers, seconds, strict=True))]
    places = np.linspace(0, len(seconds) - 1, MOST_CURVES).round().astype(int)
    chosen = [in_order[place] for place in dict.fromkeys(places)]
    if None in numbers:
        return list(zip(chosen, COLOURS, strict=False))
    shades = colormaps["viridis"](np.linspace(0.0, 0.85, len(chosen)))
    return list(zip(chosen, shades, strict=True))


def _others(axis: Any, scale: ValueScale, table: pd.Series) -> None:
    """The median formulation and the middle half of all formulations, in grey."""
    quartiles = table.groupby("value").quantile(np.array([0.25, 0.5, 0.75])).unstack().sort_index()
    values = quartiles.index.to_numpy()
    places, middle = scale.curve(values, quartiles[0.5].to_numpy())
    low, high = (scale.curve(values, quartiles[q].to_numpy())[1] for q in (0.25, 0.75))
    axis.fill_between(places, low, high, color="0.87", linewidth=0)
    axis.plot(places, middle, color="0.65", linewidth=0.9)
