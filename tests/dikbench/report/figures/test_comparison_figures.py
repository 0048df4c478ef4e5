"""Figures that compare formulations: outcomes, success against its price, parts of a step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from makers.rows import random_rows

from dikbench.metrics import Outcome
from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import style
from dikbench.report.figures.outcome_bars import draw_outcome_bars
from dikbench.report.figures.success_profile import draw_success_profiles
from dikbench.report.figures.success_scatter import (
    draw_success_against_slow_down,
    draw_success_against_time,
    success_points,
)
from dikbench.report.figures.time_split import PARTS, draw_time_split, time_parts
from dikbench.report.selection.categories import CATEGORIES
from dikbench.report.selection.rows import that_ran

SCENARIOS = ["reach", "step", "hold-still"]


def outcomes(trials: pd.DataFrame, **of: Sequence[str]) -> pd.DataFrame:
    """Give the trials of each formulation outcomes, in the order of the scenarios."""
    changed = trials.copy()
    for formulation, values in of.items():
        changed.loc[changed["formulation"].eq(formulation), "outcome"] = list(values)
    return changed


def test_bars_are_shares_of_outcomes(drawn: list[Any], target: Path) -> None:
    """A bar from 0 to 1 per formulation, its parts as long as the share of each category."""
    trials = outcomes(
        random_rows(["a", "b"], SCENARIOS),
        a=["success", "recovered", "limit-broken"],
        b=["late", "did-not-run", "left-path"],
    )
    with style():
        (figure,) = draw_outcome_bars(trials, target)
    assert figure.file == "outcomes_clock.svg"
    (axis,) = drawn[0].axes
    assert [label.get_text() for label in axis.get_yticklabels()] == ["a", "b"]
    names = [category.name for category in CATEGORIES]
    for place, expected in enumerate(
        (
            {"success": 2 / 3, "limit broken": 1 / 3},
            {"late or unfinished": 1 / 3, "left the path": 1 / 3, "broke off": 1 / 3},
        )
    ):
        bars = axis.patches[place * len(names) : (place + 1) * len(names)]
        widths = [bar.get_width() for bar in bars]
        assert widths == pytest.approx([expected.get(name, 0.0) for name in names])
        starts = [bar.get_x() for bar in bars]
        assert starts == pytest.approx(np.cumsum([0.0, *widths[:-1]]))


def test_every_outcome_is_of_one_category() -> None:
    """None is forgotten, none is of two."""
    of = [outcome for category in CATEGORIES for outcome in category.outcomes]
    assert sorted(of) == sorted(Outcome)


def test_success_over_tolerance_is_what_the_figures_of_a_trial_say(
    drawn: list[Any], target: Path
) -> None:
    """A trial 3 mm off its path succeeds from 3 mm on; a straw law is grey."""
    trials = random_rows(["near", "far", "broken"], SCENARIOS)
    needed = trials["formulation"].map({"near": 3e-3, "far": 3e-2, "broken": 1e-4})
    trials = trials.assign(
        **dict.fromkeys(
            (
                "contour_error_6d_max_m",
                "tracking_error_6d_final_m",
                "path_done_99_tolerance_m",
                "path_done_90_tolerance_m",
                "lag_tolerance_m",
            ),
            needed,
        )
    )
    broken = trials["formulation"].eq("broken")
    trials.loc[broken, ["outcome", "decided_before"]] = "limit-broken"
    trials.loc[trials["formulation"].eq("far"), "outcome"] = "left-path"
    with style():
        (figure,) = draw_success_profiles(trials, target)
    (axis,) = drawn[0].axes
    curves = {line.get_label(): line for line in axis.lines}
    for label, least in (("near", 3.0),):
        x, y = curves[label].get_data()
        assert np.array_equal(np.asarray(y) == 100.0, np.asarray(x) >= least)
    assert not any(label.startswith(("broken", "far")) for label in curves)
    assert len(axis.lines) == 3
    assert figure.title


def test_points_of_success_and_slow_down(drawn: list[Any], target: Path) -> None:
    """Success in percent, the geometric mean of the duration where it succeeds; hollow: stopped."""
    trials = outcomes(
        random_rows(["steady", "hasty"], SCENARIOS).assign(reference="path"),
        steady=["success", "success", "left-path"],
        hasty=["success", "limit-broken", "success"],
    )
    trials["slow_down"] = [2.0, 8.0, 100.0, 1.0, 1.0, 1.0]
    points = success_points(trials)
    assert points["success"].tolist() == pytest.approx([200 / 3, 200 / 3])
    assert points["slow_down"].tolist() == pytest.approx([4.0, 1.0])
    assert points["slow_down_cases"].tolist() == [2, 2]
    assert not points["slow_down_same"].any()
    assert points["stopped"].tolist() == [False, True]
    times = trials.groupby("formulation", sort=False)["formulation_time_p99_us"].median() / 1e3
    assert points["time"].tolist() == pytest.approx(times.tolist())
    with style():
        draw_success_against_slow_down(trials, target)
        draw_success_against_time(trials, target)
    for figure, across in zip(drawn, ("slow_down", "time"), strict=True):
        kept, stopped = figure.axes[0].collections
        assert kept.get_offsets()[0].tolist() == pytest.approx(points[[across, "success"]].iloc[0])
        assert (stopped.get_facecolors()[0] == 1.0).all()
        assert {text.get_text() for text in figure.axes[0].texts} >= {"steady", "hasty"}


@pytest.mark.parametrize("common", [4, 5])
def test_durations_are_of_the_same_cases_or_said_not_to_be(
    drawn: list[Any], target: Path, common: int
) -> None:
    """Of the five scenarios that both did; with four each over its own, which the caption counts.

    Who never succeeds takes nothing from the others, and has no place.
    """
    scenarios = [f"reach[distance=0.{k + 1}]" for k in range(8)]
    trials = random_rows(["steady", "picky", "lost"], scenarios).assign(reference="path")
    trials = outcomes(
        trials,
        picky=["success"] * common + ["left-path"] * (8 - common),
        lost=["left-path"] * 8,
    )
    trials["slow_down"] = [2.0] * common + [4.0] * (8 - common) + [1.5] * 8 + [9.0] * 8
    points = success_points(trials)
    assert points["slow_down"].isna().tolist() == [False, False, True]
    own = (2.0**common * 4.0 ** (8 - common)) ** (1 / 8)
    expected = 2.0 if common == 5 else own
    assert points["slow_down"].tolist()[:2] == pytest.approx([expected, 1.5])
    with style():
        (figure,) = draw_success_against_slow_down(trials, target)
    label = drawn[0].axes[0].get_xlabel()
    if common == 5:
        assert "nominal one, over the 5 cases that all of them did. Best" in figure.caption
        assert label.endswith("over the 5 cases that all of them did")
    else:
        assert "each over the cases that it did itself (4 to 8: " in figure.caption
        assert label.endswith("each over the cases that it did itself")


def test_times_are_of_the_same_scenarios_or_said_not_to_be(target: Path) -> None:
    """Six were timed for both, and one more for one of them, which does not count."""
    scenarios = [f"reach[distance=0.{k + 1}]" for k in range(7)]
    trials = random_rows(["a", "b"], scenarios).assign(reference="path")
    trials["formulation_time_p99_us"] = [1e3] * 3 + [3e3] * 3 + [9e3] + [5e3] * 6 + [np.nan]
    assert success_points(trials)["time"].tolist() == pytest.approx([2.0, 5.0])
    with style():
        (figure,) = draw_success_against_time(trials, target)
        assert "over the 6 scenarios that all of them were timed on" in figure.caption
        trials.loc[8:, "formulation_time_p99_us"] = np.nan
        (figure,) = draw_success_against_time(trials, target)
        assert "that it were timed on" not in figure.caption
        assert "(1 to 7: " in figure.caption


def test_bars_are_the_parts_of_a_step(drawn: list[Any], target: Path) -> None:
    """Each bar is stacked of the medians of its parts, the fast laws above on an axis of theirs."""
    trials = that_ran(random_rows(["dls", ("qp", "daqp")], SCENARIOS))
    slow = trials["solver"].eq("daqp")
    times = [name for name in trials.columns if name.endswith("_us")]
    trials.loc[slow, times] = 100.0 * trials.loc[slow, times]
    table = time_parts(trials)
    with style():
        draw_time_split(trials, target)
    assert len(drawn[0].axes) == 2
    for axis, contender in zip(drawn[0].axes, ("dls", "qp, daqp"), strict=True):
        assert [label.get_text() for label in axis.get_yticklabels()] == [contender]
        widths = [bar.get_width() for bar in axis.patches]
        np.testing.assert_allclose(widths, table.loc[contender, list(PARTS)].astype(float))
        starts = [bar.get_x() for bar in axis.patches]
        np.testing.assert_allclose(starts, np.cumsum([0.0, *widths[:-1]]))


def test_names_cover_neither_points_nor_names_nor_lines() -> None:
    """Forty crowded points: every name has its place to itself, or the caption names it."""
    points = np.random.default_rng(1).normal(size=(40, 2))
    names = [f"name-{number:02}" for number in range(40)]
    with style():
        figure, axis = plt.subplots(figsize=(6, 4))
        axis.plot(*points.T, "o")
        sentence = label_points(axis, points, names, ["black"] * 40)
        texts = [text for text in axis.texts if text.get_text()]
        boxes = [text.get_window_extent() for text in texts]
        places = axis.transData.transform(points)
        pixel = figure.dpi / 72.0
        lines = [
            axis.transData.transform(text.xy) + share * pixel * np.array(text.get_position())
            for text in axis.texts
            if not text.get_text()
            for share in (0.5, 0.7, 0.9)
        ]
        plt.close(figure)
    left_out = {name for name in names if name in sentence}
    assert {text.get_text() for text in texts} == set(names) - left_out
    assert len(left_out) < 10
    for number, box in enumerate(boxes):
        shrunk = box.padded(-1.0)
        assert not any(shrunk.overlaps(other) for other in boxes[:number])
        assert not any(shrunk.contains(*place) for place in (*places, *lines))
