"""Success over the tolerance: what a rate of success would be if more or less were asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import WIDTH, logarithmic, look, save, short
from dikbench.report.selection.judged import IN_WORDS, SETTINGS, judged_rows
from dikbench.report.selection.rows import names_of_contenders
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.first_places import dependable
from dikbench.statistics.success import rates, succeeded, succeeded_at, weighted_means

TOLERANCES_M: Final = np.geomspace(5e-4, 0.1, 24)

NAMED: Final = 8
"""Formulations that are named in a picture; the others are grey."""

GREY: Final = {"color": "0.8", "linewidth": 0.7, "zorder": 1}


def draw_success_profiles(trials: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw a panel per setting: rates of success, all situations, over the tolerance.

    Args:
        trials: the rows of trials.csv.
        target: the folder of figures.
    """
    rows = {setting: judged_rows(trials, setting) for setting in SETTINGS}
    rows = {
        setting: part[~part["formulation"].isin(ORACLES)]
        for setting, part in rows.items()
        if not part.empty
    }
    rows = {setting: part for setting, part in rows.items() if not part.empty}
    if not rows:
        return []
    named = _named(list(rows.values()))
    figure, axes = plt.subplots(
        1, len(rows), figsize=(WIDTH, 3.4), squeeze=False, sharey=True, sharex=True
    )
    for axis, (setting, part) in zip(axes[0], rows.items(), strict=True):
        _curves(axis, part, named)
        axis.set_title(IN_WORDS[setting])
        axis.set_xlabel("tolerance [mm]")
    logarithmic(axes[0, 0], "x")
    axes[0, 0].set_ylim(-2, 102)
    axes[0, 0].set_ylabel("success [%]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    others = "; the others in grey" if len(named) == NAMED else ""
    caption = (
        "Success over all situations (families weighed equally) if the tolerance of every scenario "
        "were that of the axis: below 2 mm the sampling is measured, from 20 mm on detours are "
        f"forgiven. Named are the {len(named)} most successful of those that may be starred (see "
        f"the table of success){others}."
    )
    return [
        Figure(save(figure, target, "success_over_tolerance"), caption, "Success over tolerance")
    ]


def _named(parts: list[pd.DataFrame]) -> list[tuple[str, str]]:
    """Choose who is named: who may be first, the most successful before the others."""
    worth: dict[tuple[str, str], float] = {}
    together = pd.concat(parts)
    of_all_settings = together[~together.index.duplicated()]
    for part in parts:
        found, may_be = rates(part, succeeded(part)), dependable(part, of_all_settings)
        names = found.contenders.itertuples(index=False, name=None)
        for name, rate in zip(names, found.rate, strict=True):
            if name in may_be:
                worth[name] = max(worth.get(name, 0.0), float(rate))
    return sorted(worth, key=lambda name: -worth[name])[:NAMED]


def _curves(axis: Any, part: pd.DataFrame, named: list[tuple[str, str]]) -> None:
    called = names_of_contenders(part)
    found = rates(part, succeeded(part))
    names = list(found.contenders.itertuples(index=False, name=None))
    done = [succeeded_at(part, float(tolerance)).astype(float) for tolerance in TOLERANCES_M]
    values = 100 * np.array([weighted_means(found.layout.fill(each), found.base) for each in done])
    for k, name in enumerate(names):
        if name not in named:
            axis.plot(1e3 * TOLERANCES_M, values[:, k], **GREY)
    for number, name in enumerate(named):
        if name in names:
            curve = values[:, names.index(name)]
            axis.plot(1e3 * TOLERANCES_M, curve, label=short(called[name]), **look(number))
