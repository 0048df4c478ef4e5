"""The phase diagram of near misses: its cells hold the table's values, its panels the laws."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from makers.rows import random_rows
from matplotlib.collections import QuadMesh

from dikbench.arrays import Array
from dikbench.report.drawing.style import style
from dikbench.report.figures.phase_diagram import (
    against_limit,
    draw_phase_diagrams,
    three_digits,
)
from dikbench.report.selection.categories import CATEGORIES
from dikbench.report.selection.phase_grids import phase_grids

MISSES, SPEEDS = (0.0, 0.01, 0.1), (0.2, 1.0)

GRID = [
    f"near-miss[robot=ur5,miss={miss:g},speed={speed:g}]" for miss in MISSES for speed in SPEEDS
]


def cells(axis: Any, mesh: int = 0) -> Array:
    """The values of a map, (speeds, misses), without the gap after miss = 0; NaN where none is."""
    found = [artist for artist in axis.collections if isinstance(artist, QuadMesh)][mesh]
    values: Any = found.get_array()
    return np.delete(np.ma.filled(values.astype(float), np.nan), 1, axis=1)


def test_cells_hold_what_the_table_says(drawn: list[Any], target: Path) -> None:
    """Each cell of the error and of the speed map is the trial's value, and is written in it."""
    trials = random_rows(["dls", "pinv"], GRID)
    trials["contour_error_rms_m"] = 2.0 * trials["position_error_rms_m"]
    with style():
        figures = draw_phase_diagrams(trials, target)
    assert [figure.file for figure in figures] == [
        f"phase_diagram_1_{name}.svg" for name in ("error", "peak_speed", "outcome")
    ]
    by_cell = trials.set_index(["formulation", "scenario"])
    for figure, column, scale in (
        (drawn[0], "contour_error_rms_m", 1e3),
        (drawn[1], "velocity_peak_ratio", 1.0),
    ):
        panels = {axis.get_title(): axis for axis in figure.axes if axis.get_title()}
        assert panels.keys() == {"dls", "pinv"}
        for formulation, axis in panels.items():
            wanted = np.array([scale * by_cell.loc[(formulation, name), column] for name in GRID])
            wanted = wanted.reshape(len(MISSES), len(SPEEDS)).T
            np.testing.assert_allclose(cells(axis), wanted)
            assert [text.get_text() for text in axis.texts] == [
                three_digits(value) for value in wanted.ravel()
            ]


def test_a_label_at_the_limit_agrees_with_the_outcome(drawn: list[Any], target: Path) -> None:
    """1.0005 keeps the limit and is 1, on blue; 1.0012 breaks it, is >1, and is not on blue."""
    trials = random_rows(["dls"], GRID, seeds=(0, 1))
    peaks = [0.5, 1.0, 1.0005, 1.001, 1.0012, 1.2]
    trials["velocity_peak_ratio"] = np.repeat(peaks, 2) * np.tile([0.9, 1.0], 6)
    trials["outcome"] = np.where(trials["velocity_peak_ratio"].le(1.001), "success", "limit-broken")
    with style():
        draw_phase_diagrams(trials, target)
    speed, outcome = drawn[1].axes[0], drawn[2].axes[0]
    kept = cells(outcome) == 0
    mesh = next(artist for artist in speed.collections if isinstance(artist, QuadMesh))
    blue = mesh.cmap.get_under()
    is_blue = (np.abs(mesh.to_rgba(cells(speed)) - blue) < 1e-6).all(axis=-1)
    assert np.array_equal(is_blue, kept)
    assert kept.sum() == 4
    labels = np.array([text.get_text() for text in speed.texts]).reshape(kept.shape)
    for label, keeps in zip(labels.ravel(), kept.ravel(), strict=True):
        assert (label in (".5", "1")) == keeps
        assert (label in (">1", "1.2")) != keeps


def test_a_failed_trial_is_black_and_a_missing_one_blank(drawn: list[Any], target: Path) -> None:
    """No number of a trial that did not end well is shown, nor of one that was never run."""
    trials = random_rows(["dls"], GRID)
    trials.loc[0, ["status", "outcome"]] = "diverged"
    with style():
        draw_phase_diagrams(trials.drop(index=5), target)
    axis = drawn[0].axes[0]
    shown, failed = cells(axis), cells(axis, mesh=1)
    assert np.isnan(shown[0, 0])
    assert failed[0, 0] == 1.0
    assert np.isnan(shown[1, 2])
    assert np.isnan(failed[1, 2])
    assert np.isfinite(shown).sum() == 4
    assert np.isfinite(failed).sum() == 1
    assert cells(drawn[2].axes[0])[0, 0] == len(CATEGORIES) - 1


def test_who_stands_still_has_cells_like_others(drawn: list[Any], target: Path) -> None:
    """A peak speed and an error of 0 have no logarithm; they are drawn and written as 0."""
    trials = random_rows(["idle", "pinv"], GRID)
    idle = trials["formulation"].eq("idle")
    trials.loc[idle, ["velocity_peak_ratio", "contour_error_rms_m"]] = 0.0
    with style():
        draw_phase_diagrams(trials, target)
    for figure in drawn[:2]:
        [axis] = [axis for axis in figure.axes if axis.get_title() == "idle"]
        mesh = next(artist for artist in axis.collections if isinstance(artist, QuadMesh))
        colours = mesh.to_rgba(cells(axis))
        assert (colours[..., 3] == 1).all()  # a masked value is transparent
        assert [text.get_text() for text in axis.texts] == ["0"] * len(GRID)
        assert {text.get_color() for text in axis.texts} == {"black"}


def test_laws_stand_in_the_order_of_how_they_do(drawn: list[Any], target: Path) -> None:
    """The oracle first, a law that keeps the limits before one that does not, then by the error."""
    trials = random_rows(["violating", "far", "near", "oracle"], GRID)
    formulation = trials["formulation"]
    trials["outcome"] = np.where(formulation.eq("violating"), "limit-broken", "success")
    trials["position_error_rms_m"] = formulation.map(
        {"violating": 0.0, "near": 1e-3, "far": 1e-2, "oracle": 1.0}
    )
    trials = trials.drop(columns="contour_error_rms_m", errors="ignore").copy()
    with style():
        draw_phase_diagrams(trials, target)
    titles = [axis.get_title() for axis in drawn[0].axes if axis.get_title()]
    assert titles == ["oracle", "near", "far", "violating"]


def test_a_row_of_near_misses_is_no_grid() -> None:
    """Two misses at two speeds are a grid, three misses at one speed are none."""
    assert len(phase_grids(random_rows(["dls"], GRID[:4]))) == 1
    assert not phase_grids(random_rows(["dls"], GRID[::2]))
    assert not phase_grids(random_rows(["dls"], ["near-miss", "reach[miss=1,speed=1]"]))


def test_many_laws_make_several_pages(drawn: list[Any], target: Path) -> None:
    """21 formulations are in two figures of about as many panels, and none is left out."""
    names = [f"formulation-{number}" for number in range(21)]
    with style():
        figures = draw_phase_diagrams(random_rows(names, GRID[:4]), target)
    errors = [
        shown for figure, shown in zip(figures, drawn, strict=True) if "_error" in figure.file
    ]
    titles = [[axis.get_title() for axis in shown.axes if axis.get_title()] for shown in errors]
    assert [len(page) for page in titles] == [11, 10]
    assert {title for page in titles for title in page} == set(names)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.96, "1"), (1.001, "1"), (1.0010001, ">1"), (1.04, ">1"), (1.06, "1.1")],
)
def test_a_peak_speed_says_on_which_side_of_its_limit_it_is(value: float, text: str) -> None:
    """As outcomes count it: up to 1.001."""
    assert against_limit(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.034, ".03"), (0.4, ".4"), (0.97, "1.0"), (2.14, "2.1"), (9.96, "10"),
     (420.4, "420"), (23456.0, "2e4")],
)  # fmt: skip
def test_numbers_fit_into_a_cell(value: float, text: str) -> None:
    """A number has at most three characters or so."""
    assert three_digits(value) == text
