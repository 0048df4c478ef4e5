"""Outcomes as stacked bars, per formulation and situation: the first picture of a report."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.patches import Patch

from dikbench.arrays import Array
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import WIDTH, save, short
from dikbench.report.selection.categories import CATEGORIES, categories
from dikbench.report.selection.judged import DEFINITIONS, IN_WORDS, SETTINGS, judged_rows
from dikbench.report.selection.rows import names_of_contenders, pages
from dikbench.statistics.success import hierarchical_weights

BAR_IN: Final = 0.17
"""Height of a bar with the room to the next one [in]."""

PER_PAGE: Final = 40
"""Formulations in one figure."""


def draw_outcome_bars(trials: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw for each setting a bar per formulation and situation.

    Args:
        trials: the rows of trials.csv.
        target: the folder of figures.
    """
    figures = []
    for setting in SETTINGS:
        rows = judged_rows(trials, setting)
        if rows.empty:
            continue
        called = names_of_contenders(trials)
        pairs = zip(rows["formulation"], rows["solver"], strict=True)
        rows = rows.assign(contender=[called[pair] for pair in pairs], category=categories(rows))
        parts = pages(list(dict.fromkeys(rows["contender"])), PER_PAGE)
        for page, names in enumerate(parts, start=1):
            number = f"_{page}" if len(parts) > 1 else ""
            title = f"Outcomes where {IN_WORDS[setting]}"
            file = f"outcomes_{'path' if setting == 'path' else 'clock'}{number}"
            caption = (
                f"{title}: the share of each outcome, per formulation and situation, over the "
                "trials of scenarios that a known motion can do (families, robots and scenarios "
                "weighed equally; the number of trials of each formulation stands above)."
            )
            figures.append(Figure(_draw(rows, names, target, file), caption, title))
    return figures


def shares(rows: pd.DataFrame) -> Array:
    """Compute the share of each category among the trials of a formulation, (categories,)."""
    weights = hierarchical_weights(rows.reset_index(drop=True))
    found: Array = np.zeros(len(CATEGORIES))
    np.add.at(found, rows["category"].to_numpy(dtype=int), weights)
    return found


def _draw(rows: pd.DataFrame, names: list[str], target: Path, file: str) -> str:
    situations = [each for each in DEFINITIONS if rows["situation"].eq(each).any()]
    height = 0.95 + BAR_IN * len(names)
    figure, axes = plt.subplots(
        1, len(situations), figsize=(WIDTH, height), sharey=True, squeeze=False
    )
    for axis, situation in zip(axes[0], situations, strict=True):
        part = rows[rows["situation"].eq(situation)]
        counts = part.groupby("contender").size()
        _bars(axis, part, names)
        axis.set_title(f"{situation.replace(' ', chr(10), 1)}\n({int(counts.max())})")
    axes[0, 0].set_yticks(range(len(names)), [short(name) for name in names])
    axes[0, 0].set_ylim(len(names) - 0.5, -0.5)
    handles = [
        Patch(facecolor=each.colour, edgecolor="0.5", linewidth=0.4, label=each.name)
        for place, each in enumerate(CATEGORIES)
        if rows["category"].eq(place).any()
    ]
    columns = len(handles) if len(handles) < len(CATEGORIES) else len(handles) // 2
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, columnspacing=1)
    return save(figure, target, file)


def _bars(axis: Any, part: pd.DataFrame, names: list[str]) -> None:
    for place, name in enumerate(names):
        own = part[part["contender"].eq(name)]
        if own.empty:
            continue
        left = 0.0
        for category, share in zip(CATEGORIES, shares(own), strict=True):
            axis.barh(
                place, share, 0.8, left, color=category.colour, edgecolor="0.5", linewidth=0.3
            )
            left += float(share)
    axis.set_xlim(0.0, 1.0)
    axis.set_xticks([0.0, 1.0], ["0", "100 %"])
    axis.tick_params(length=0)
    axis.grid(visible=False)
