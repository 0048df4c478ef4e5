"""Figures that compare laws by a point or a bar each: Pareto, error against time, time split."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from makers.rows import random_rows

from dikbench.report.drawing.labels import label_points
from dikbench.report.drawing.style import style
from dikbench.report.figures.error_and_time import cost_points, draw_error_and_time
from dikbench.report.figures.pareto import contender_points, draw_off_course_and_slow_down, front
from dikbench.report.figures.time_split import PARTS, draw_time_split, time_parts
from dikbench.report.selection.rows import that_ran

SCENARIOS = ["reach", "step", "hold-still"]

PAIRS = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12)


@given(PAIRS)
def test_nothing_beats_a_point_of_the_front(points: list[tuple[int, int]]) -> None:
    """A point is off the front exactly if another is as small in both and smaller in one."""
    for point, best in zip(points, front(np.array(points, dtype=float)), strict=True):
        beaten = any(a <= point[0] and b <= point[1] and (a, b) != point for a, b in points)
        assert best == (not beaten)


def test_points_of_off_course_and_slow_down(drawn: list[Any], target: Path) -> None:
    """A point is the mean over the scenarios; a law that violates is hollow and off the front."""
    trials = random_rows(["slow", "wide", "both", "violating", "slower"], SCENARIOS)
    contender = trials["formulation"]
    trials["progress_mean"] = contender.map(
        {"slow": 0.5, "wide": 1.0, "both": 0.4, "violating": 1.0, "slower": 0.1}
    )
    trials["direction_error_max_rad"] = np.radians(
        contender.map({"slow": 1e-9, "wide": 90.0, "both": 90.0, "violating": 0.0, "slower": 0.0})
    )
    trials["violating_share"] = contender.eq("violating") * 0.1
    trials.loc[0, "progress_mean"] = 0.2
    with style():
        (figure,) = draw_off_course_and_slow_down(trials, target)
    axis = drawn[0].axes[0]
    keeping, violating = (set(map(tuple, dots.get_offsets())) for dots in axis.collections)
    assert {(round(x), round(y)) for x, y in keeping} == {(60, 0), (0, 90), (60, 90), (90, 0)}
    assert violating == {(0.0, 0.0)}
    assert [round(x) for x in axis.lines[0].get_xdata()] == [0, 60]
    assert {text.get_text() for text in axis.texts} >= {"slow", "wide", "both", "violating"}
    assert figure.title
    assert (target / figure.png).is_file()


def test_a_failed_trial_counts_worst() -> None:
    """A trial that failed is 180 deg off course and makes none of the motion."""
    trials = random_rows(["dls"], SCENARIOS).assign(direction_error_max_rad=0.0, progress_mean=1.0)
    trials.loc[0, "status"] = "diverged"
    points = contender_points(trials)
    assert points.loc["dls", "off_course"] == 60.0
    assert points.loc["dls", "slow_down"] == pytest.approx(100 / 3)


def test_error_against_time_is_a_point_per_law_and_solver(drawn: list[Any], target: Path) -> None:
    """Medians over the timed scenarios, one point per law and solver, hollow where unstable."""
    trials = random_rows(["dls", ("qp", "daqp"), ("qp", "osqp")], SCENARIOS)
    trials = that_ran(trials.drop(columns="contour_error_rms_m", errors="ignore"))
    trials.loc[trials["solver"].eq("osqp"), "timing_stability"] = "drift: of the machine"
    trials.loc[trials["scenario"].eq("step"), "formulation_time_p99_us"] = np.nan
    points = cost_points(trials)
    timed = trials[trials["scenario"].ne("step")].groupby("contender")
    np.testing.assert_allclose(
        points["time"], timed["formulation_time_p99_us"].median()[points.index]
    )
    np.testing.assert_allclose(
        points["error"], 1e3 * timed["position_error_rms_m"].median()[points.index]
    )
    assert dict(points["stable"]) == {"dls": True, "qp, daqp": True, "qp, osqp": False}
    with style():
        draw_error_and_time(trials, target)
    dots = {d.get_label(): d for d in drawn[0].axes[0].collections}
    hollow = dots["with a solver, timing not stable"]
    np.testing.assert_allclose(
        hollow.get_offsets()[0], points.loc["qp, osqp", ["time", "error"]].astype(float)
    )
    assert (hollow.get_facecolors()[0] == 1.0).all()
    assert {text.get_text() for text in drawn[0].axes[0].texts} >= set(points.index)


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
