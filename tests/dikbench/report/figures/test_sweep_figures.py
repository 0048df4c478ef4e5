"""Sweeps of a scenario's parameter and of a formulation's: found, and drawn as the table says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from makers.rows import random_rows

from dikbench.report.drawing.style import style
from dikbench.report.drawing.value_scale import ValueScale
from dikbench.report.figures.formulation_sweeps import draw_formulation_sweeps, formulation_sweeps
from dikbench.report.figures.scenario_sweeps import draw_sweeps
from dikbench.report.selection.sweeps import sweeps

MISSES = ("0", "0.01", "0.1")


def test_a_grid_is_one_sweep() -> None:
    """Of miss x speed the longer axis is swept and the other one tells the curves apart."""
    grid = [f"near-miss[miss={m},speed={v}]" for v in ("1", "2", "3") for m in (*MISSES, "1")]
    (sweep,) = sweeps(random_rows(["dls"], grid))
    assert (sweep.family, sweep.parameter, sweep.second) == ("near-miss", "miss", "speed")
    assert set(zip(sweep.rows["value"], sweep.rows["second"], strict=True)) == {
        (float(m), v) for m in (*MISSES, "1") for v in ("1", "2", "3")
    }


def test_robots_are_curves_of_one_sweep() -> None:
    """A parameter that is no number tells curves apart too; two values are no sweep."""
    names = [f"reach[robot={r},gain={g}]" for r in ("ur5", "panda") for g in (4, 5, 6)]
    names += ["step[distance=1]", "step[distance=2]", "hold-still"]
    (sweep,) = sweeps(random_rows(["dls"], names))
    assert (sweep.family, sweep.parameter, sweep.second) == ("reach", "gain", "robot")


def test_curves_hold_what_the_table_says(drawn: list[Any], target: Path) -> None:
    """Each formulation has a panel, each of its points is the median over the seeds."""
    scenarios = [f"near-miss[miss={miss}]" for miss in MISSES]
    trials = random_rows(["dls", "pinv"], scenarios, seeds=(0, 1, 2))
    trials = trials.drop(columns="contour_error_rms_m", errors="ignore")
    with style():
        figures = draw_sweeps(trials, target)
    assert [f.file for f in figures] == [
        "error_against_miss_1.svg",
        "peak_speed_against_miss_1.svg",
    ]
    panels = {axis.get_title(): axis for axis in drawn[0].axes}
    assert panels.keys() == {"dls", "pinv"}
    scale = ValueScale([float(miss) for miss in MISSES])
    for formulation, axis in panels.items():
        curve = next(line for line in axis.lines if line.get_marker() == "o")
        places, heights = (values[~np.isnan(curve.get_xdata())] for values in curve.get_data())
        of_formulation = trials[trials["formulation"] == formulation]
        wanted = (
            1e3 * of_formulation.groupby("scenario", sort=False)["position_error_rms_m"].median()
        )
        np.testing.assert_allclose(places, scale.places)
        np.testing.assert_allclose(heights, wanted.clip(lower=1e-2))


def test_a_failed_trial_is_a_gap_and_a_cross(drawn: list[Any], target: Path) -> None:
    """Where a trial failed its curve has no point, and a cross stands at the top."""
    trials = random_rows(["dls"], [f"near-miss[miss={miss}]" for miss in ("0.1", "0.2", "0.3")])
    trials.loc[1, "status"] = "timeout"
    with style():
        draw_sweeps(trials, target)
    lines = drawn[0].axes[0].lines
    curve = next(line for line in lines if line.get_marker() == "o")
    cross = next(line for line in lines if line.get_marker() == "x")
    assert list(np.isnan(curve.get_ydata())) == [False, True, False]
    assert list(cross.get_xdata()) == [0.2]


def test_zero_stands_apart_on_a_logarithmic_scale() -> None:
    """Decades are a unit long, 0 is left of them, and no curve leads there."""
    scale = ValueScale([0.1, 0.0, 1.0, 10.0])
    np.testing.assert_allclose(scale.places, [-0.5, 0.0, 1.0, 2.0])
    places, heights = scale.curve(scale.values, np.arange(4.0))
    assert np.isnan(places[1])
    assert np.isnan(heights[1])
    np.testing.assert_allclose(ValueScale([3, 1, 2]).places, [1, 2, 3])


def test_a_law_sweep_takes_success_the_median_error_and_the_worst_speed(
    drawn: list[Any], target: Path
) -> None:
    """Against the damping, per family."""
    formulations = [f"dls[damping={damping}]" for damping in ("0.01", "0.1", "1")]
    scenarios = ["reach", "reach[gain=2]", "reach[gain=4]", "step"]
    trials = random_rows([*formulations, "pinv", "qp[gain=1]"], scenarios)
    trials = trials.drop(columns="contour_error_rms_m", errors="ignore")
    trials.loc[[0, 1, 4], "outcome"] = "late"
    (sweep,) = formulation_sweeps(trials)
    assert (sweep.formulation, sweep.parameter) == ("dls", "damping")
    with style():
        (figure,) = draw_formulation_sweeps(trials, target)
    assert figure.file == "formulation_dls_damping_1.svg"
    reach = trials[trials["scenario"].str.startswith("reach")]
    by_formulation = reach.groupby("formulation", sort=False)
    wanted: tuple[Any, ...] = (
        [100 / 3, 200 / 3, 100.0],
        (1e3 * by_formulation["position_error_rms_m"].median())[formulations].clip(lower=1e-2),
        by_formulation["velocity_peak_ratio"].max()[formulations],
    )
    for axis, values in zip(drawn[0].axes, wanted, strict=True):
        curve = next(line for line in axis.lines if line.get_label() == "reach")
        np.testing.assert_allclose(curve.get_ydata(), values)
        np.testing.assert_allclose(curve.get_xdata(), [0.0, 1.0, 2.0])


def test_what_nothing_can_do_has_no_curve_of_success(drawn: list[Any], target: Path) -> None:
    """Of a family of which one scenario can be done that one alone counts; the caption says it."""
    formulations = [f"dls[damping={damping}]" for damping in ("0.01", "0.1", "1")]
    trials = random_rows(formulations, ["reach", "reach[gain=2]", "step", "far"])
    trials.loc[trials["scenario"].eq("far"), "feasible"] = "no"
    trials.loc[trials["scenario"].eq("reach[gain=2]"), "feasible"] = "unknown"
    trials.loc[~trials["feasible"].eq("time"), "outcome"] = "left-path"
    with style():
        (figure,) = draw_formulation_sweeps(trials, target)
    success, error, _ = drawn[0].axes
    curves = {line.get_label(): line.get_ydata() for line in success.lines}
    assert np.isnan(curves["far"]).all()
    assert list(curves["reach"]) == list(curves["step"]) == [100.0] * 3
    assert any(line.get_label() == "far" and np.isfinite(line.get_ydata()).all()
               for line in error.lines)  # fmt: skip
    assert "Without a curve of success: far, which no known motion can do." in figure.caption
    trials["feasible"] = "path"
    with style():
        (figure,) = draw_formulation_sweeps(trials, target)
    assert "Without" not in figure.caption


@pytest.mark.parametrize("count", [1, pytest.param(13, marks=pytest.mark.long), 25])
def test_any_number_of_laws_is_drawn(target: Path, count: int) -> None:
    """One formulation, a dozen and one more than a page holds, each page below 200 kB."""
    names = [f"a-formulation-with-a-rather-long-name-{number}[gain=1]" for number in range(count)]
    scenarios = [f"near-miss[miss={miss}]" for miss in ("0.1", "0.2", "0.3")]
    with style():
        figures = draw_sweeps(random_rows(names, scenarios), target)
    assert len(figures) == 2 * -(-count // 24)
    for figure in figures:
        assert (target / figure.file).stat().st_size < 200_000
        assert (target / figure.png).is_file()
