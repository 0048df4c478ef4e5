"""The phase diagram: what each law makes of near misses, over miss distance and speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize, to_rgb
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from dikbench.array import Array
from dikbench.oracle import ORACLE
from dikbench.report.figure import Figure
from dikbench.report.near_miss_grids import NearMissGrid, near_miss_grids
from dikbench.report.outcomes import OFF_COURSE, OUTCOMES, SLOW, outcomes
from dikbench.report.panels import small_multiples
from dikbench.report.rows import error_column, how, pages, with_failures
from dikbench.report.style import save

PER_PAGE = 20
"""Laws in one figure."""

GAP = 0.3
"""Between the column of miss = 0, which is a case of its own, and the others [cells]."""

FAILED = "#222222"
NO_TRIAL = "#ececec"

OUTCOME_COLOURS = ("#e8f1e4", "#56B4E9", "#E69F00", "#D55E00", FAILED)
OUTCOME_MARKS = ("", "s", "o", "v", "x")


@dataclass(frozen=True, eq=False)
class _Map:
    """A quantity over a grid: its values per law, how they are coloured and written."""

    name: str
    title: str
    explained: str
    values: Mapping[str, Array]
    colours: Colormap
    norm: Normalize
    bar: str
    extend: str = "neither"

    def text(self, value: float) -> str:
        if self.name == "outcome":
            return OUTCOME_MARKS[round(value)]
        return three_digits(value)


def draw_phase_diagrams(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw, for each grid of near misses, the error, the peak speed and the outcome per law."""
    figures = []
    for number, grid in enumerate(near_miss_grids(ran), start=1):
        maps = [m for m in _maps(grid) if any(np.isfinite(v).any() for v in m.values.values())]
        parts = pages(_laws_in_order(grid.rows), PER_PAGE)
        for one in maps:
            for page, laws in enumerate(parts, start=1):
                file = f"phase_diagram_{number}_{one.name}" + (f"_{page}" * (len(parts) > 1))
                of = f" (part {page} of {len(parts)})" if len(parts) > 1 else ""
                caption = (
                    f"{one.explained} Near misses ({grid.others or 'defaults'}), {how(grid.rows)}, "
                    "a panel per law: the oracle, which moves along the path as asked for, then "
                    f"from the best law to the worst{of}. Black: the trial failed."
                )
                title = f"Phase diagram of near misses, {grid.others or 'defaults'}: {one.title}{of}"
                figures.append(Figure(_draw(grid, laws, one, target, file), caption, title))
    return figures


def _laws_in_order(rows: pd.DataFrame) -> list[str]:
    """The oracle first, then by the mean outcome, then by the median error."""
    column, _ = error_column(rows)
    worth = rows.assign(outcome=outcomes(rows), error=with_failures(rows, column))
    by_law = worth.groupby("formulation", sort=False)
    table = pd.DataFrame({"outcome": by_law["outcome"].mean(), "error": by_law["error"].median()})
    order = table.sort_values(["outcome", "error"], kind="stable").index
    return sorted(order, key=lambda name: name != ORACLE)


def _maps(grid: NearMissGrid) -> list[_Map]:
    column, name = error_column(grid.rows)
    ended = grid.rows["status"].eq("ok")
    rows = grid.rows.assign(
        error_mm=1e3 * grid.rows[column].where(ended),
        peak=grid.rows["velocity_peak_ratio"].where(ended),
        outcome=outcomes(grid.rows).astype(float),
    )
    shown = NearMissGrid(grid.others, grid.misses, grid.speeds, rows)
    errors, peaks = shown.values("error_mm"), shown.values("peak")
    over = colormaps["YlOrRd"].with_extremes(under="#d5e3ee")
    return [
        _Map(
            "error",
            name,
            f"Root mean square {name} [mm].",
            errors,
            colormaps["viridis_r"],
            _log_norm(errors, 1e-2, 1e3),
            f"rms {name} [mm]",
            "both",
        ),
        _Map(
            "peak_speed",
            "peak speed",
            "Largest joint speed over its limit; blue where it keeps the limit (to 1 %).",
            peaks,
            over,
            _log_norm(peaks, 1.01, 1e2, least=1.01),
            "largest joint speed over its limit",
            "both",
        ),
        _Map(
            "outcome",
            "outcome",
            "What became of the trial, the worst that applies: failed; violating a limit; off "
            f"course (more than {np.degrees(OFF_COURSE):.0f} deg from the wanted direction at some "
            f"step); slow (less than {100 * SLOW:.0f} % of the wanted motion at some step); ok.",
            shown.values("outcome"),
            ListedColormap(list(OUTCOME_COLOURS)),
            BoundaryNorm(np.arange(-0.5, len(OUTCOMES)), len(OUTCOMES)),
            "",
        ),
    ]


def _log_norm(values: Mapping[str, Array], low: float, high: float, least: float = 0.0) -> LogNorm:
    """A logarithmic scale from the smallest to the largest value, within bounds and a decade."""
    whole = np.concatenate([v.ravel() for v in values.values()])
    positive = whole[np.isfinite(whole) & (whole > 0)]
    bottom = least or float(np.clip(positive.min(initial=high), low, high / 10))
    top = float(np.clip(positive.max(initial=low), 10 * bottom, high))
    return LogNorm(bottom, top)


def _draw(grid: NearMissGrid, laws: Sequence[str], one: _Map, target: Path, file: str) -> str:
    edges, centres = _columns(grid.misses)
    rows = len(grid.speeds)
    figure, axes = small_multiples(laws, height=0.42 + 0.2 * max(rows, 3))
    failed = grid.rows.assign(failed=grid.rows["status"].ne("ok").astype(float))
    failures = NearMissGrid(grid.others, grid.misses, grid.speeds, failed).values("failed")
    for axis, law in zip(axes, laws, strict=True):
        axis.grid(visible=False)
        axis.set_facecolor("white")
        for side in ("left", "bottom"):
            axis.spines[side].set_visible(False)
        _cells(axis, edges, np.full((rows, len(centres)), 0.0), ListedColormap([NO_TRIAL]))
        _cells(axis, edges, one.values[law], one.colours, one.norm)
        broken = np.where(failures[law] > 0.5, 1.0, np.nan)
        _cells(axis, edges, broken, ListedColormap([FAILED]))
        _write(axis, centres, one, one.values[law], broken)
        axis.set_xlim(edges[0], edges[-1])
        axis.set_ylim(0, rows)
        axis.set_xticks(centres, [f"{miss:g}" for miss in grid.misses], rotation=90)
        axis.set_yticks(np.arange(rows) + 0.5, [f"{speed:g}" for speed in grid.speeds])
        axis.tick_params(length=0, pad=2)
    figure.supxlabel("miss distance [m; rad]", fontsize=8)
    figure.supylabel("speed past the singularity [rad/s; m/s]", fontsize=8)
    _key(figure, axes, one)
    return save(figure, target, file)


def _columns(misses: Sequence[float]) -> tuple[Array, Array]:
    """Edges and centres of the columns; that of miss = 0 stands apart."""
    apart = misses[0] == 0.0
    edges = np.arange(len(misses) + 1.0 - apart)
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


def _write(axis: Any, centres: Array, one: _Map, values: Array, broken: Array) -> None:
    for (row, column), value in np.ndenumerate(values):
        if np.isfinite(broken[row, column]):
            text, colour = "x", "white"
        elif np.isfinite(value):
            text, colour = one.text(value), _readable_on(one.colours(one.norm(value)))
        else:
            continue
        axis.text(
            centres[column], row + 0.47, text, ha="center", va="center", fontsize=5, color=colour
        )


def _readable_on(background: Any) -> str:
    """Black or white, whichever stands out (relative luminance of sRGB)."""
    linear = [((c + 0.055) / 1.055) ** 2.4 if c > 0.04045 else c / 12.92 for c in to_rgb(background)]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return "black" if luminance > 0.18 else "white"


def _key(figure: Any, axes: Sequence[Any], one: _Map) -> None:
    """The colour bar, or what the categories are called."""
    if one.name == "outcome":
        handles = [
            Patch(facecolor=colour, edgecolor="0.6", linewidth=0.4, label=f"{name} ({mark})" if mark else name)
            for colour, name, mark in zip(OUTCOME_COLOURS, OUTCOMES, OUTCOME_MARKS, strict=True)
        ]  # fmt: skip
        figure.legend(handles=handles, loc="outside upper center", ncols=min(5, 2 * len(axes)))
        return
    bar = figure.colorbar(
        ScalarMappable(one.norm, one.colours),
        ax=list(axes),
        location="top",
        aspect=50,
        shrink=0.7,
        pad=0.02,
        extend=one.extend,
    )
    bar.set_label(one.bar)
    bar.ax.xaxis.set_minor_locator(NullLocator())
    bar.ax.xaxis.set_major_locator(LogLocator(subs=(1.0,) if one.norm.vmax > 30 * one.norm.vmin else (1, 2, 5)))
    bar.ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
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
