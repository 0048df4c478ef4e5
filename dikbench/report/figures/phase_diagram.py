"""Phase diagrams: what each formulation makes of a family, over two of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize, to_rgb
from matplotlib.patches import Patch

from dikbench.arrays import Array, Mask
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.panels import place_at_top, small_multiples
from dikbench.report.drawing.style import label_decades, save
from dikbench.report.selection.categories import CATEGORIES, categories
from dikbench.report.selection.declared import with_unit
from dikbench.report.selection.phase_grids import PhaseGrid, phase_grids
from dikbench.report.selection.rows import error_column, failures_at_infinity, how, pages
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.violation import SPEED_TOLERANCE

PER_PAGE = 20
"""Formulations in one figure."""

GAP = 0.18
"""Between the column of 0, which is a case of its own, and the others [cells]."""

LEAST = 1e-9
"""Zeros are drawn as this, at the low end of a logarithmic scale: who idles has a peak speed."""

BROKEN_FROM: Final = float(np.nextafter(SPEED_TOLERANCE, 2.0))
"""The least peak speed over its limit that breaks it."""

BROKE_OFF = CATEGORIES[-1]


@dataclass(frozen=True, eq=False)
class _Map:
    """A quantity over a grid: its values per formulation, how they are coloured and written.

    Without the label of a colour bar it is of categories.
    """

    name: str
    title: str
    explained: str
    values: Mapping[str, Array]
    colours: Colormap
    norm: Normalize
    text: Callable[[float], str]
    bar: str = ""


def draw_phase_diagrams(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw for each grid of a family the error, the peak speed and the outcome per formulation."""
    figures = []
    for number, grid in enumerate(phase_grids(ran.assign(category=categories(ran))), start=1):
        maps = [m for m in _maps(grid) if any(np.isfinite(v).any() for v in m.values.values())]
        parts = pages(_formulations_in_order(grid.rows), PER_PAGE)
        for one in maps:
            for page, formulations in enumerate(parts, start=1):
                file = f"phase_diagram_{number}_{one.name}" + (f"_{page}" * (len(parts) > 1))
                of = f" (part {page} of {len(parts)})" if len(parts) > 1 else ""
                caption = (
                    f"{one.explained} Scenarios {grid.family} ({grid.others or 'defaults'}), "
                    f"{how(grid.rows)}, a panel per formulation: the oracle, which moves along the "
                    f"path as asked for, then from the best to the worst{of}. Black: the trial "
                    "broke off."
                )
                title = (
                    f"Phase diagram of {grid.family}, {grid.others or 'defaults'}: {one.title}{of}"
                )
                figures.append(Figure(_draw(grid, formulations, one, target, file), caption, title))
    return figures


def _formulations_in_order(rows: pd.DataFrame) -> list[str]:
    """The oracle first, then by the mean outcome, then by the median error."""
    column, _ = error_column(rows)
    worth = rows.assign(error=failures_at_infinity(rows, column))
    by_formulation = worth.groupby("formulation", sort=False)
    table = pd.DataFrame(
        {"category": by_formulation["category"].mean(), "error": by_formulation["error"].median()}
    )
    order = table.sort_values(["category", "error"], kind="stable").index
    return sorted(order, key=lambda name: name not in ORACLES)


def _maps(grid: PhaseGrid) -> list[_Map]:
    column, name = error_column(grid.rows)
    ended = grid.rows["status"].eq("ok")
    rows = grid.rows.assign(
        error_mm=1e3 * grid.rows[column].where(ended),
        peak=grid.rows["velocity_peak_ratio"].where(ended),
    )
    shown = replace(grid, rows=rows)
    errors, peaks = (
        {name: np.maximum(each, LEAST) for name, each in values.items()}
        for values in (shown.values("error_mm", "median"), shown.values("peak", "max"))
    )
    over = colormaps["YlOrRd"].with_extremes(under="#d5e3ee")
    return [
        _Map(
            "error",
            name,
            f"Root mean square {name} [mm] of the motion, the median over its seeds, however much "
            "of the path it did: who stands still has none (see the outcomes).",
            errors,
            colormaps["viridis_r"],
            _log_norm(errors, 1e-2, 1e3),
            three_digits,
            f"rms {name} [mm]",
        ),
        _Map(
            "peak_speed",
            "peak speed",
            "Largest joint speed over its limit, the worst of its seeds; blue where it keeps the "
            f"limit, as an outcome counts it (at most {SPEED_TOLERANCE:g} of it), and written as 1 "
            "or less there; what is just beyond is written as >1.",
            peaks,
            over,
            _log_norm(peaks, BROKEN_FROM, 1e2, least=BROKEN_FROM),
            against_limit,
            "largest joint speed over its limit",
        ),
        _Map(
            "outcome",
            "outcome",
            "What became of the trial, the worst over its seeds.",
            shown.values("category", "max"),
            ListedColormap([category.colour for category in CATEGORIES]),
            BoundaryNorm(np.arange(-0.5, len(CATEGORIES)), len(CATEGORIES)),
            lambda value: CATEGORIES[round(value)].mark,
        ),
    ]


def _log_norm(values: Mapping[str, Array], low: float, high: float, least: float = 0.0) -> LogNorm:
    """A logarithmic scale from the smallest to the largest value, within bounds and a decade."""
    whole = np.concatenate([v.ravel() for v in values.values()])
    positive = whole[np.isfinite(whole) & (whole > 0)]
    bottom = least or float(np.clip(positive.min(initial=high), low, high / 10))
    top = float(np.clip(positive.max(initial=low), 10 * bottom, high))
    return LogNorm(bottom, top)


def _draw(grid: PhaseGrid, formulations: Sequence[str], one: _Map, target: Path, file: str) -> str:
    edges, centres = _columns(grid.columns)
    rows = len(grid.lines)
    figure, axes = small_multiples(
        formulations,
        0.2 * max(rows, 3),
        with_unit(grid.family, grid.across),
        with_unit(grid.family, grid.up),
        top=0.68,
    )
    worst = grid.values("category", "max")
    for axis, formulation in zip(axes, formulations, strict=True):
        axis.grid(visible=False)
        axis.set_facecolor("white")
        for side in ("left", "bottom"):
            axis.spines[side].set_visible(False)
        values = one.values[formulation]
        failed = np.isnan(values) & (worst[formulation] == len(CATEGORIES) - 1)
        _cells(axis, edges, values, one.colours, one.norm)
        if failed.any():
            _cells(axis, edges, np.where(failed, 1.0, np.nan), ListedColormap([BROKE_OFF.colour]))
        _write(axis, centres, one, values, failed)
        axis.tick_params(length=0, pad=2)
        axis.tick_params(axis="x", labelrotation=90)
    axes[0].set_xlim(edges[0], edges[-1])  # they share their axes
    axes[0].set_ylim(0, rows)
    axes[0].set_xticks(centres, [f"{value:g}" for value in grid.columns])
    axes[0].set_yticks(np.arange(rows) + 0.5, [f"{speed:g}" for speed in grid.lines])
    _key(figure, one)
    return save(figure, target, file)


def _columns(values: Sequence[float]) -> tuple[Array, Array]:
    """Compute edges and centres of the columns; that of the value 0 stands apart."""
    apart = values[0] == 0.0
    edges = np.arange(len(values) + 1.0 - apart)
    centres = edges[:-1] + 0.5
    if apart:
        edges = np.concatenate([[-GAP - 1.0, -GAP], edges])
        centres = np.concatenate([[-GAP - 0.5], centres])
    return edges, centres


def _cells(
    axis: Any, edges: Array, values: Array, colours: Colormap, norm: Normalize | None = None
) -> None:
    """Colour the cells of a map; NaN leaves one as it is, and so stays the gap."""
    if len(edges) > values.shape[1] + 1:
        values = np.insert(values, 1, np.nan, axis=1)
    axis.pcolormesh(
        edges,
        np.arange(len(values) + 1.0),
        np.ma.masked_invalid(values),
        cmap=colours,
        norm=norm,
        edgecolors="white",
        linewidth=0.4,
        rasterized=True,
    )


def _write(axis: Any, centres: Array, one: _Map, values: Array, failed: Mask) -> None:
    for (row, column), value in np.ndenumerate(values):
        if failed[row, column]:
            text, colour = BROKE_OFF.mark, "white"
        elif np.isfinite(value):
            text, colour = one.text(value), _readable_on(one.colours(one.norm(value)))
        else:
            continue
        axis.text(
            centres[column],
            row + 0.47,
            text,
            ha="center",
            va="center",
            fontsize=5,
            color=colour,
            in_layout=False,
        )


def _readable_on(background: Any) -> str:
    """Black or white, whichever stands out (relative luminance of sRGB)."""
    linear = [
        ((c + 0.055) / 1.055) ** 2.4 if c > 0.04045 else c / 12.92 for c in to_rgb(background)
    ]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "black" if luminance > 0.18 else "white"


def _key(figure: Any, one: _Map) -> None:
    """The colour bar, or what the categories are called."""
    if not one.bar:
        handles = [
            Patch(
                facecolor=category.colour,
                edgecolor="0.6",
                linewidth=0.4,
                label=f"{category.name} ({category.mark})" if category.mark else category.name,
            )
            for category in CATEGORIES
        ]
        figure.legend(handles=handles, loc="upper center", ncols=4)
        return
    bar = figure.colorbar(
        ScalarMappable(one.norm, one.colours),
        cax=place_at_top(figure, width=4.5, height=0.08, down=0.36),
        orientation="horizontal",
        ticklocation="top",
        extend="both",
    )
    bar.set_label(one.bar)
    bar.ax.tick_params(pad=1)
    label_decades(bar.ax.xaxis, bar.vmin, bar.vmax)
    bar.outline.set_visible(False)


def three_digits(value: float) -> str:
    """A number in at most three characters or so: 0, .03, .4, 2.1, 35, 420, 2e4."""
    if value < 0.005:
        return "0"
    if value < 0.95:
        return f"{value:.1g}".removeprefix("0")
    if value < 9.95:
        return f"{value:.1f}"
    return f"{value:.0f}" if value < 999.5 else f"{value:.0e}".replace("e+0", "e")


def against_limit(value: float) -> str:
    """A peak speed over its limit, which is 1 or less where, as outcomes count, the limit is kept.

    Beyond, `>1` stands for what would be rounded to that.
    """
    text = three_digits(value)
    if value < BROKEN_FROM:
        return "1" if text == "1.0" else text
    return ">1" if text == "1.0" else text
