"""Success, error and peak speed against a parameter of a formulation, per family of scenarios."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import WIDTH, file_name, logarithmic, look, marker, save, short
from dikbench.report.drawing.value_scale import ValueScale
from dikbench.report.selection.rows import (
    LEAST_ERROR,
    error_column,
    failures_at_infinity,
    how,
    one_way,
)
from dikbench.report.selection.stored_motions import in_panels
from dikbench.report.selection.sweeps import FEWEST, number
from dikbench.report.sentences.words import listed as listed_names
from dikbench.results.selected import parameters_of
from dikbench.selector import listed
from dikbench.statistics.success import DONE, with_facts


@dataclass(frozen=True, eq=False)
class FormulationSweep:
    """Trials of one formulation of which one numeric parameter takes several values.

    Attributes:
        formulation: its name.
        parameter: what is swept.
        others: its other parameters, as in a selector.
        rows: its trials, with a column `value`.
    """

    formulation: str
    parameter: str
    others: str
    rows: pd.DataFrame


def formulation_sweeps(ran: pd.DataFrame) -> list[FormulationSweep]:
    """Find the formulations of which one numeric parameter takes at least three values."""
    chosen = one_way(ran)
    names = dict(zip(chosen["formulation"], chosen["formulation_name"], strict=True))
    groups: dict[tuple[str, str, str], dict[str, float]] = {}
    for formulation, parameters in parameters_of(chosen, "formulation").items():
        for parameter, given in parameters.items():
            value = number(given)
            if value is not None:
                rest = {k: v for k, v in parameters.items() if k != parameter}
                key = (names[formulation], parameter, listed(rest))
                groups.setdefault(key, {})[formulation] = value
    found = []
    for (formulation, parameter, others), values in groups.items():
        if len(set(values.values())) >= FEWEST:
            rows = chosen[chosen["formulation"].isin(values)]
            rows = rows.assign(value=rows["formulation"].map(values))
            found.append(FormulationSweep(formulation, parameter, others, rows))
    return found


def draw_formulation_sweeps(ran: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw every sweep of a numeric parameter of a formulation."""
    figures = []
    for place, sweep in enumerate(formulation_sweeps(ran), start=1):
        if not np.isfinite(per_family(sweep)["error"]).any():
            continue
        _, name = error_column(sweep.rows)
        file = file_name("formulation", sweep.formulation, sweep.parameter, place)
        caption = (
            f"{sweep.formulation}{f' ({sweep.others})' if sweep.others else ''} against its "
            f"{sweep.parameter}, {how(sweep.rows)}: the share that succeeds of the trials of "
            f"scenarios that a known motion can do, the median rms {name} and the largest peak "
            "speed, over all scenarios of each family; a trial that broke off counts as infinite, "
            f"and infinity leaves a gap.{_without_success(sweep)}"
        )
        title = f"{sweep.formulation} against its {sweep.parameter}"
        figures.append(Figure(_draw(sweep, target, file), caption, title))
    return figures


def _without_success(sweep: FormulationSweep) -> str:
    """Name the families of which no scenario can be done as far as is known."""
    success = per_family(sweep)["success"].groupby(level="family", sort=False).count()
    none = sorted(success[success.eq(0)].index)
    if not none:
        return ""
    return f" Without a curve of success: {listed_names(none)}, which no known motion can do."


def per_family(sweep: FormulationSweep) -> pd.DataFrame:
    """Compute per family and value `success` [%], the median `error` [mm], the worst `peak`.

    Success is NaN where no scenario of a family is known to be done by any motion.
    """
    column, _ = error_column(sweep.rows)
    rows = with_facts(sweep.rows)
    counts = rows["feasible"].isin(["time", "path"])
    table = pd.DataFrame(
        {
            "family": rows["scenario_family"],
            "value": rows["value"],
            "error": 1e3 * failures_at_infinity(rows, column),
            "peak": failures_at_infinity(rows, "velocity_peak_ratio"),
            "success": 100.0 * rows["outcome"].isin(DONE).astype(float).where(counts),
        }
    )
    groups = table.groupby(["family", "value"], sort=False)
    taken = groups.agg({"success": "mean", "error": "median", "peak": "max"})
    return taken.sort_index(level="value")


def _draw(sweep: FormulationSweep, target: Path, file: str) -> str:
    _, name = error_column(sweep.rows)
    quantities = {
        "success": "success [%]",
        "error": f"rms {name} [mm],\nmedian",
        "peak": "peak speed over limit,\nworst",
    }
    table, scale = per_family(sweep), ValueScale(sweep.rows["value"])
    table["error"] = table["error"].clip(lower=1e3 * LEAST_ERROR)
    finite = table.where(table < float("inf"))
    panels = in_panels(list(dict.fromkeys(sweep.rows["scenario_family"])))
    figure, axes = plt.subplots(
        len(panels),
        len(quantities),
        figsize=(WIDTH, 1.0 + 1.5 * len(panels)),
        sharex=True,
        sharey="col",
        squeeze=False,
    )
    for line, families in zip(axes, panels, strict=True):
        for axis, quantity in zip(line, quantities, strict=True):
            for place, kind in enumerate(families):
                _curve(axis, scale, finite.loc[kind][quantity], short(kind, 22), place)
        line[2].axhline(1.0, color="0.4", linewidth=0.7, zorder=1)
        line[-1].legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
    for axis, label in zip(axes[0], quantities.values(), strict=True):
        axis.set_title(label)
    axes[0, 0].set_ylim(-4, 104)
    logarithmic(axes[0, 1], "y")
    logarithmic(axes[0, 2], "y")
    scale.label(list(axes.flat))
    figure.supxlabel(f"{short(sweep.parameter)} of {short(sweep.formulation)}", fontsize=8)
    return save(figure, target, file)


def _curve(axis: Any, scale: ValueScale, curve: pd.Series, label: str, place: int) -> None:
    style = {**look(place), **marker(place), "linewidth": 1.2}
    points = scale.curve(curve.index.to_numpy(dtype=float), curve.to_numpy())
    axis.plot(*points, label=label, markersize=3.5, **style)
