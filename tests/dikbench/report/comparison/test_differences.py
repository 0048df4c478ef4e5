"""Differences, ratios and versions of results folders made by hand, computed on paper."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dikbench.errors import DikbenchError
from dikbench.report.comparison.comparison import compare
from dikbench.report.comparison.differences import difference, worsening
from dikbench.report.comparison.rendering import render
from dikbench.report.comparison.tolerances import parse_tolerance


def test_differences_by_hand(folder: Callable[..., Path]) -> None:
    """Counts, means and the worst trial of four changes, computed on paper."""

    def change(table: pd.DataFrame) -> None:
        table.loc[:3, "position_error_max_m"] = [0.5, 0.8, 0.3, 0.9]

    row = compare(folder("a"), folder("b", change)).formulations.iloc[0]
    assert (row["formulation"], row["metric"]) == ("dls", "position_error_max_m")
    assert (row["trials"], row["worse"], row["better"]) == (6, 2, 1)
    assert row["mean_a"] == pytest.approx(0.5)
    assert row["mean_difference"] == pytest.approx((0 + 0.3 - 0.2 + 0.4) / 6)
    assert row["worst_difference"] == pytest.approx(0.4)
    assert (row["scenario"], row["seed"]) == ("near-miss[miss=0.1]", 1)
    assert row["low"] < row["mean_difference"] < row["high"]
    assert -0.2 <= row["low"] < row["high"] <= 0.4


def test_intervals_hold_a_constant_shift(folder: Callable[..., Path]) -> None:
    """The interval of differences of 0.1, but for rounding, is 0.1: there is no other noise."""

    def shift(table: pd.DataFrame) -> pd.DataFrame:
        noise = 1e-9 * np.arange(len(table))
        return table.assign(orientation_error_max_rad=0.6 + noise)

    formulations = compare(folder("a"), folder("b", shift)).formulations
    np.testing.assert_allclose(formulations[["low", "high"]], 0.1, atol=1e-7)


@pytest.mark.parametrize(
    ("before", "after", "apart", "worse"),
    [
        (np.nan, np.nan, 0.0, 0.0),
        (np.inf, np.inf, 0.0, 0.0),
        (1.0, np.nan, np.nan, np.inf),
        (np.nan, 1.0, np.nan, 0.0),
        (1.0, np.inf, np.inf, np.inf),
        (np.inf, 1.0, -np.inf, -np.inf),
        (1.0, 1.25, 0.25, 0.25),
    ],
)
def test_undefined_and_infinite_values(
    before: float, after: float, apart: float, worse: float
) -> None:
    """The same on both sides is no difference; on one side it is one, worse where B lost it."""
    a, b = np.array([before]), np.array([after])
    np.testing.assert_equal(difference(a, b), [apart])
    np.testing.assert_equal(worsening("low", a, b), [worse])


def test_times_are_ratios_with_their_doubts(folder: Callable[..., Path]) -> None:
    """Twice and half as long on two scenarios is the same on average; doubts are spoken out."""

    def slow(table: pd.DataFrame) -> None:
        dls = table["formulation"].eq("dls")
        table.loc[dls & table["scenario"].eq("reach"), "formulation_time_median_us"] = 20.0
        table.loc[dls & table["scenario"].str.contains("0.2"), "formulation_time_median_us"] = 5.0
        table.loc[dls & table["scenario"].eq("reach"), "timing_stability"] = "drift: much"
        table["formulation_time_p99_us"] = 60.0

    result = compare(folder("a"), folder("b", slow, cpu="two cores"))
    dls, qp = result.times.to_dict("records")
    assert (dls["ratio"], qp["ratio"]) == (pytest.approx(1), pytest.approx(1))
    assert (dls["p99_ratio"], dls["unstable"], qp["unstable"]) == (pytest.approx(3), 1, 0)
    assert 0.5 <= dls["low"] < 1 < dls["high"] <= 2
    text = render(result)
    assert "The machines differ" in text
    assert "1 were not stable" in text
    assert result.formulations.empty


def test_versions_are_shown(folder: Callable[..., Path]) -> None:
    """Commit, libraries, solvers and the machine where they differ, and only there."""
    a = folder("a")
    b = folder(
        "b",
        lambda table: table.assign(id=table["id"] + "x"),
        git_commit="bbb",
        libraries={"numpy": "2.1", "pin": "4.1", "cvxpy": None},
        solvers={"daqp": "0.7", "osqp": "1.0"},
    )
    found = compare(a, b)
    assert found.versions == [
        ("git_commit", "aaa", "bbb"),
        ("numpy", "2.0", "2.1"),
        ("osqp", "-", "1.0"),
    ]
    assert found.same_machine
    assert "12 of the trials in both have another id" in render(found)


def test_tolerances_are_absolute_or_relative() -> None:
    """Five percent of 2 is 0.1; of zero it is nothing, and any worsening is beyond it."""
    relative, absolute = parse_tolerance("sigma_min = 5%"), parse_tolerance("sigma_min=0.1")
    worse, a = np.array([0.09, 0.11, 1e-9, 0.0, -1.0]), np.array([2.0, -2.0, 0.0, 0.0, 2.0])
    assert relative.exceeded(worse, a).tolist() == [False, True, True, False, False]
    assert absolute.exceeded(worse, a).tolist() == [False, True, False, False, False]
    with pytest.raises(DikbenchError, match="valid: "):
        parse_tolerance("speed=1")


def test_better_is_the_registry_s_business(folder: Callable[..., Path]) -> None:
    """Less progress is worse, more is better, whatever the sign of the difference."""
    less = folder("less", lambda table: table.assign(progress_mean=0.4))
    more = folder("more", lambda table: table.assign(progress_mean=0.6))
    same = folder("same")
    assert compare(same, less, [parse_tolerance("progress_mean=0.05")]).regressed
    assert not compare(same, more, [parse_tolerance("progress_mean=0.05")]).regressed
    formulations = compare(same, less).formulations
    assert list(formulations["worse"]) == [6, 6]
    assert list(compare(same, more).formulations["better"]) == [6, 6]
    np.testing.assert_allclose(formulations["mean_difference"], -0.1)


def test_the_documented_tolerances() -> None:
    """Those of the CI example are valid."""
    page = Path(__file__).parents[4] / "docs" / "guides" / "guard-a-ci.md"
    found = re.findall(r"--tolerance (\S+=\S+)", page.read_text(encoding="utf-8"))
    assert [parse_tolerance(text).relative for text in found] == [False, True, False, True]
