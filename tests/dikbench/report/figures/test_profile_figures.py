"""The figures of performance and data profiles: what they count, and that they are drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.figure
import numpy as np
import pandas as pd
import pytest

import dikbench.report.figures.profiles as figures
from dikbench.arrays import Array
from dikbench.report.drawing.style import style
from dikbench.report.figures.profiles import NAMED, Costs, draw_profiles
from dikbench.report.selection.rows import LEAST_ERROR

INF = np.inf


def _trials(contenders: dict[str, list[float | None]], **columns: list[str]) -> pd.DataFrame:
    """A trial per law and scenario with its contour error; infinite: it failed, None: skipped."""
    rows = []
    for contender, errors in contenders.items():
        for number, error in enumerate(errors):
            status = "skipped" if error is None else "diverged" if error == INF else "ok"
            recorded = error if status == "ok" else 1e-9  # what a failure recorded is no use
            rows.append(
                {
                    "formulation": contender, "solver": "none",
                    "scenario": f"reach[number={number}]",
                    "plant": "ideal", "reference": "path", "seed": 0, "status": status,
                    "steps": 0 if status == "skipped" else 10,
                    "contour_error_rms_m": recorded, "contour_error_max_m": recorded,
                    "position_error_rms_m": 1.0, "position_error_max_m": 1.0,
                    "path_done_share": 1.0,
                }
            )  # fmt: skip
    return pd.DataFrame(rows).assign(**columns)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, matplotlib.figure.Figure]:
    """The figures that are saved, by name; they are written to no file."""
    kept: dict[str, matplotlib.figure.Figure] = {}

    def keep(figure: matplotlib.figure.Figure, folder: Path, name: str) -> str:
        figure.draw_without_rendering()
        kept[name] = figure
        return f"{name}.svg"

    monkeypatch.setattr(figures, "save", keep)
    return kept


def _line(axis: Any, label: str) -> Array:
    line = next(line for line in axis.get_lines() if line.get_label() == label)
    points: Array = line.get_xydata()
    return points


def test_failures_and_skips_are_problems_not_solved() -> None:
    """Whatever a failed trial recorded; errors below the least count as equal."""
    trials = _trials({"a": [1e-3, INF, 1e-9], "b": [2e-3, 1e-2, 1e-8], "c": [None, 1e-2, INF]})
    costs = Costs.of(trials[trials["status"] != "skipped"], "rms", late=False)
    assert costs.contenders == ["a", "b", "c"]
    assert costs.words == "rms contour error"
    expected = [[1e-3, 2e-3, INF], [INF, 1e-2, 1e-2], [LEAST_ERROR, LEAST_ERROR, INF]]
    np.testing.assert_array_equal(costs.errors, expected)


def test_who_stands_still_on_the_path_has_not_followed_it() -> None:
    """A law that leaves a tenth of the path undone has solved nothing, however near it stayed.

    Where the reference does not wait the distance from the target counts, which grows with the lag;
    a scenario that has no path (NaN) has nothing to leave undone.
    """
    trials = _trials({"goes": [1e-3, 1e-3], "rests": [1e-5, 1e-5]})
    trials["path_done_share"] = [0.96, np.nan, 0.9, np.nan]
    on_path = Costs.of(trials, "rms", late=False)
    np.testing.assert_array_equal(on_path.errors, [[1e-3, INF], [1e-3, LEAST_ERROR]])
    assert "more than 5% of the path undone" in on_path.undone
    in_time = Costs.of(trials, "rms", late=True)
    np.testing.assert_array_equal(in_time.errors, [[1.0, 1.0], [1.0, 1.0]])
    assert (in_time.words, in_time.undone) == ("rms position error", "")


def test_a_problem_without_an_error_to_measure_is_none() -> None:
    """A scenario without a path has no contour; one that nobody survived counts against all."""
    trials = _trials({"a": [1e-3, np.nan, INF], "b": [2e-3, INF, INF]})
    np.testing.assert_array_equal(
        Costs.of(trials, "max", late=False).errors, [[1e-3, 2e-3], [INF, INF]]
    )


def test_older_results_are_compared_by_their_position_error() -> None:
    """Where no contour error was measured."""
    trials = _trials({"a": [1e-3], "b": [2e-3]})
    old = trials.drop(columns=["contour_error_rms_m", "contour_error_max_m"])
    assert Costs.of(old, "max", late=False).words == "largest position error"
    assert (Costs.of(old, "rms", late=False).errors == 1.0).all()


def test_the_curves_are_the_profiles(drawn: dict[str, matplotlib.figure.Figure]) -> None:
    """By hand: heights at 1, 2 and beyond; pairs alone at the right; targets of data profiles."""
    trials = _trials({"a": [1e-3, 1e-3, 1e-3], "b": [2e-3, 2e-3, 9e-3], "c": [3e-3, 3e-3, 4e-3]})
    with style():
        found = draw_profiles(trials, Path())
        assert [figure.file for figure in found] == [
            "performance_profiles_1.svg",
            "data_profiles.svg",
        ]
        whole, against_b, against_c = drawn["performance_profiles_1"].axes
    for contender, heights in {"a": (1, 1, 1), "b": (0, 0, 1), "c": (0, 0, 1)}.items():
        points = _line(whole, contender)
        for factor, height in zip((1.0, 1.9, 9.5), heights, strict=True):
            assert np.interp(factor, *points.T) == pytest.approx(height)
    assert {axis.get_title() for axis in (against_b, against_c)} == {"b", "c"}
    data = _line(drawn["data_profiles"].axes[0], "b")
    assert np.interp(5e-3, *data.T) == pytest.approx(2 / 3)


def test_the_caption_says_where_the_order_flips(
    drawn: dict[str, matplotlib.figure.Figure],
) -> None:
    """Gould & Scott's phenomenon is told, and only where it happens."""
    # On the first problem b and c are out of sight of a, and far apart without it.
    flips = _trials({"a": [1e-5, 1e-3], "b": [1e-1, 1e-3], "c": [1e-2, 2e-3]})
    steady = _trials({"a": [1e-3] * 3, "b": [2e-3] * 3, "c": [3e-3] * 3})
    with style():
        assert "the order changes" not in draw_profiles(steady, Path())[0].caption
        caption = draw_profiles(flips, Path())[0].caption
    assert caption.endswith("Without a the order changes: c comes before b.")


def test_plants_and_reference_modes_have_pictures_of_their_own(
    drawn: dict[str, matplotlib.figure.Figure],
) -> None:
    """A performance profile each; the data profiles side by side, a law in one colour in all."""
    one = _trials({"a": [1e-3, 2e-3], "b": [2e-3, 1e-3]})
    two = one.assign(plant="saturating")
    three = one[one["formulation"] == "a"].assign(plant="a plant of one formulation")
    with style():
        found = draw_profiles(pd.concat([one, two, three]), Path())
        panels = [axis for axis in drawn["data_profiles"].axes if axis.get_visible()]
        colours = [
            {line.get_label(): line.get_color() for line in axis.get_lines()} for axis in panels
        ]
    assert len(found) == 3
    assert "ideal plant" in found[0].title
    assert "saturating plant" in found[1].title
    assert colours[0] == colours[1]


def test_of_many_laws_the_best_are_named(drawn: dict[str, matplotlib.figure.Figure]) -> None:
    """The others are grey, and the caption says how many."""
    trials = _trials({f"formulation{i}": [1e-3 * (i + 1)] for i in range(12)})
    with style():
        caption = draw_profiles(trials, Path())[0].caption
        labels = [line.get_label() for line in drawn["performance_profiles_1"].axes[0].get_lines()]
    named = [label for label in map(str, labels) if not label.startswith("_")]
    assert named == [f"formulation{i}" for i in range(NAMED)]
    assert len(labels) == 12
    assert f"the {12 - NAMED} after the eighth in grey" in caption


@pytest.mark.parametrize(
    "contenders",
    [{}, {"a": [1e-3]}, {"a": [INF], "b": [INF]}, {"a": [1e-3], "oracle": [0.0]}, {"a": [None]}],
)
def test_nothing_to_compare_is_no_figure(
    contenders: dict[str, list[float | None]], tmp_path: Path
) -> None:
    """No trials, one formulation, nothing but failures, nobody but the oracle."""
    trials = _trials(contenders) if contenders else _trials({"a": [1e-3]}).iloc[:0]
    with style():
        assert draw_profiles(trials, tmp_path) == []


def test_hostile_names_are_drawn(tmp_path: Path) -> None:
    """As text: no formula, no tag."""
    trials = _trials({"$\\frac{": [1e-3, 2e-3], "<script>&": [2e-3, 1e-3], "a\nb%": [INF, 1e-3]})
    with style():
        found = draw_profiles(trials, tmp_path)
    for figure in found:
        assert "<script>" not in (tmp_path / figure.file).read_text()
