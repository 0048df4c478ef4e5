"""Performance profiles, with pairwise ones beside them, and data profiles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import WIDTH, logarithmic, look, save, short
from dikbench.report.selection.rows import LEAST_ERROR, how, one_solver_each
from dikbench.scenario.oracle import ORACLES
from dikbench.statistics.data_profile import data_profile
from dikbench.statistics.failures import has_failed, ran
from dikbench.statistics.performance_profile import area, performance_ratios, profile
from dikbench.statistics.trial_matrix import TrialMatrix

NAMED = 8
"""Formulations that are named in a picture; the others are grey."""

PAIRS = 6
"""Formulations that are compared with the first one alone."""

DONE = 0.95
"""A formulation that leaves more of the path than this undone has not solved the problem: to stand
still on the path is no way to follow it."""

LARGEST = 1e3
"""Ratio at which performance profiles end."""

FACTORS = np.geomspace(1.0, LARGEST, 361)
TARGETS = np.geomspace(1e-5, 1e-1, 241)

GREY = {"color": "0.8", "linewidth": 0.7, "zorder": 1}
STEPS = {"drawstyle": "steps-post"}


def draw_profiles(trials: pd.DataFrame, target: Path) -> list[Figure]:
    """Draw performance profiles for each plant and reference mode, and the data profiles of all.

    Each formulation is drawn with the first of its solvers; the oracle is none.

    Args:
        trials: the rows of trials.csv, skipped and failed ones too.
        target: the folder of figures.
    """
    contenders = one_solver_each(ran(trials[~trials["formulation"].isin(ORACLES)]))
    ways = [(how(rows), rows) for _, rows in contenders.groupby(["plant", "reference"], sort=False)]
    figures: list[Figure] = []
    for name, rows in ways:
        costs = Costs.of(rows, "rms", late=bool(rows["reference"].eq("time").all()))
        if costs.comparable:
            file = f"performance_profiles_{len(figures) + 1}"
            figures.append(_performance(costs, name, target, file))
    errors = {name: Costs.of(rows, "max", late=False) for name, rows in ways}
    errors = {name: costs for name, costs in errors.items() if costs.comparable}
    return [*figures, _data(errors, target)] if errors else figures


@dataclass(frozen=True, eq=False)
class Costs:
    """The errors of formulations on the same problems.

    Attributes:
        formulations: names.
        errors: (problems, formulations) [m], at least `LEAST_ERROR`; infinite where a formulation
            did not solve a problem: it failed, or was skipped.
        words: what the errors are.
        undone: what else counts as not solved, in words.
    """

    contenders: list[str]
    errors: Array
    words: str
    undone: str

    @classmethod
    def of(cls, rows: pd.DataFrame, kind: str, *, late: bool) -> Costs:
        """The errors of trials from their target, or from their path.

        Args:
            rows: of one plant and reference mode.
            kind: `rms` or `max`.
            late: whether being late is an error, as for a reference that does not wait: then the
                distance from the target counts. Else that from the path does (where it was
                measured), and who leaves more than `1 - DONE` of the path undone has solved
                nothing.
        """
        contour = f"contour_error_{kind}_m"
        is_there = not late and contour in rows and rows[contour].notna().any()
        column = contour if is_there else f"position_error_{kind}_m"
        words = (
            f"{'rms' if kind == 'rms' else 'largest'} {'contour' if is_there else 'position'} error"
        )
        recorded = rows[column].to_numpy(dtype=float)
        layout = TrialMatrix.of(rows)
        failed = has_failed(rows)
        if is_there and "path_done_share" in rows:
            failed = failed | rows["path_done_share"].lt(DONE).to_numpy()
        errors = layout.fill(np.where(failed, np.nan, np.maximum(recorded, LEAST_ERROR)))
        # A problem that formulations went through without an error to measure (no path) is none.
        went_through = layout.fill(np.where(failed, 0.0, 1.0), 0.0).any(axis=1)
        defined = ~np.isnan(errors).all(axis=1) | ~went_through
        solved = np.where(np.isnan(errors), np.inf, errors)[defined]
        undone = f", and those that left more than {1 - DONE:.0%} of the path undone,"
        return cls(
            list(layout.contenders["formulation"]), solved, words, undone if is_there else ""
        )

    @property
    def comparable(self) -> bool:
        """Whether there are two formulations, and a problem that one of them solved."""
        return len(self.contenders) > 1 and bool(np.isfinite(self.errors).any())


def _performance(costs: Costs, name: str, target: Path, file: str) -> Figure:
    """All laws in one profile at the left, the first one against each of the next at the right."""
    ratios = performance_ratios(costs.errors)
    order = _order(ratios)
    first, *others = order[: PAIRS + 1]
    figure = plt.figure(figsize=(WIDTH, 3.6))
    places = figure.add_gridspec(2, 5)
    whole = figure.add_subplot(places[:, :2])
    _curves(whole, costs.contenders, order, FACTORS, profile(ratios, FACTORS))
    whole.set_title("all formulations")
    whole.set_ylabel("share of the problems")
    for place, (second, axis) in enumerate(zip(others, _small(figure, places), strict=False)):
        pair = [first, second]
        shares = profile(performance_ratios(costs.errors[:, pair]), FACTORS)
        for column, number in enumerate((0, place + 1)):
            axis.plot(FACTORS, shares[:, column], **{**look(number), **STEPS, "linewidth": 1.3})
        _factor_axis(axis)
        axis.set_title(short(costs.contenders[second], 18))
        axis.tick_params(labelleft=place % 3 == 0, labelbottom=place >= len(others) - 3)
    _factor_axis(whole)
    figure.supxlabel(
        f"{costs.words} over the smallest of the formulations in the picture", fontsize=8
    )
    figure.legend(*whole.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    caption = (
        f"Performance profiles, {name}: the share of the {len(ratios)} problems (scenarios and "
        f"seeds) on which the {costs.words} of a law is within a factor of the smallest; errors "
        f"below {LEAST_ERROR:g} m count as equal, failed and skipped trials{costs.undone} as not "
        f"solved. The laws are ordered by the area under their curves{_left_over(order)}. Of many "
        "formulations a profile ranks the first one only: at the right "
        f"{costs.contenders[first]} with each of the next laws alone, whose name stands above."
        f"{_flip(costs, order)}"
    )
    return Figure(save(figure, target, file), caption, f"Performance profiles, {name}")


def _data(errors: dict[str, Costs], target: Path) -> Figure:
    """A panel per plant and reference mode; a formulation looks the same in all."""
    heights: dict[str, list[float]] = {}
    shares = {name: data_profile(costs.errors, TARGETS) for name, costs in errors.items()}
    for name, costs in errors.items():
        for contender, height in zip(costs.contenders, shares[name].mean(axis=0), strict=True):
            heights.setdefault(contender, []).append(float(height))
    ranked = sorted(heights, key=lambda contender: -float(np.mean(heights[contender])))
    rows = -(-len(errors) // 2)
    figure, axes = plt.subplots(
        rows, min(len(errors), 2), figsize=(WIDTH, 0.6 + 2.4 * rows), squeeze=False, sharey=True
    )
    for axis in axes.flat[len(errors) :]:
        axis.set_visible(False)
    for axis, (name, costs) in zip(axes.flat, errors.items(), strict=False):
        order = [
            costs.contenders.index(contender) if contender in costs.contenders else -1
            for contender in ranked
        ]
        _curves(axis, costs.contenders, order, TARGETS, shares[name])
        axis.set_xlim(TARGETS[0], TARGETS[-1])
        logarithmic(axis, "x")
        axis.set_ylim(-0.02, 1.02)
        axis.set_title(f"{name}, {len(costs.errors)} problems")
        axis.set_xlabel(f"target: {costs.words} [m]")
    for axis in axes[:, 0]:
        axis.set_ylabel("share of the problems")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    caption = (
        "Data profiles: the share of the problems (scenarios and seeds) that a law follows with "
        "an error below a target all along the way; failed and skipped trials"
        f"{next(iter(errors.values())).undone} are not solved. A "
        "curve does not depend on the other laws. The laws are ordered by their mean height"
        f"{_left_over(ranked)}."
    )
    return Figure(save(figure, target, "data_profiles"), caption, "Data profiles")


def _curves(axis: Any, contenders: list[str], order: list[int], x: Array, shares: Array) -> None:
    """Draw the curves of laws in an order, the first ones named; a law of -1 is not there."""
    for number, contender in enumerate(order):
        if contender < 0:
            continue
        if number < NAMED:
            axis.plot(
                x, shares[:, contender], label=short(contenders[contender]), **look(number), **STEPS
            )
        else:
            axis.plot(x, shares[:, contender], **GREY, **STEPS)


def _small(figure: Any, places: Any) -> Iterator[Any]:
    """The axes of pairs, in reading order."""
    for row in range(2):
        for column in range(2, 5):
            yield figure.add_subplot(places[row, column])


def _factor_axis(axis: Any) -> None:
    axis.set_xlim(0.93, LARGEST)  # the share at 1 is to be seen
    logarithmic(axis, "x")
    axis.set_ylim(-0.02, 1.02)


def _order(ratios: Array) -> list[int]:
    """Formulations by the area under their profile, the largest first."""
    return [int(contender) for contender in np.argsort(-area(ratios, LARGEST), kind="stable")]


def _left_over(order: list[Any]) -> str:
    return f", the {len(order) - NAMED} after the eighth in grey" if len(order) > NAMED else ""


def _flip(costs: Costs, order: list[int]) -> str:
    """A sentence where two named formulations change places when the first one is taken out."""
    others = order[1:NAMED]
    kept = [
        order[1:][contender] for contender in _order(performance_ratios(costs.errors[:, order[1:]]))
    ]
    without = [contender for contender in kept if contender in others]
    for before, after in zip(others, without, strict=True):
        if before != after:
            return (
                f" Without {costs.contenders[order[0]]} the order changes: "
                f"{costs.contenders[after]} comes "
                f"before {costs.contenders[before]}."
            )
    return ""
