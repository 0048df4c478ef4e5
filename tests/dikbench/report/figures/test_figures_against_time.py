"""Figures against time show what the stored traces hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers.rows import random_rows

from dikbench.metrics import Motion, motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.report.drawing.style import style
from dikbench.report.figures.every import draw_figures
from dikbench.report.figures.joint_margins import draw_joint_margins, joint_margin
from dikbench.report.figures.time_series import draw_time_series
from dikbench.report.selection.stored_motions import in_panels, thinned
from dikbench.results.folder import ResultsFolder
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import make_solve

CROSSING = "joint-limit-crossing[robot=ur5]"
LAWS = ["pinv", "pinv[after=clip]", "dls"]


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder that holds the traces of three formulations and no more."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "traces").mkdir()
    scenario = make_scenario(CROSSING)
    for number, formulation in enumerate(LAWS):
        run = simulate(scenario, make_formulation(formulation), make_solve(None, None), Ideal())
        run.trace.save(folder / "traces" / f"{number:016x}.arrow")
    return folder


@pytest.fixture
def trials() -> pd.DataFrame:
    """The rows of the three formulations, and of a fourth whose trace was not kept."""
    return random_rows([*LAWS, "sdls"], [CROSSING])


def curves(axes: Any) -> dict[str, Any]:
    """The named curves of some axes."""
    lines = (line for axis in axes for line in axis.lines)
    return {line.get_label(): line for line in lines if not line.get_label().startswith("_")}


def stored_motion(folder: Path, number: int) -> Motion:
    """The stored motion of a law."""
    trace = Trace.load(folder / "traces" / f"{number:016x}.arrow")
    return motion_of(trace, make_scenario(CROSSING))


def test_errors_and_speeds_are_those_of_the_motion(
    stored: Path, trials: pd.DataFrame, drawn: list[Any], target: Path
) -> None:
    """The largest value of each curve is the largest of the motion; laws without trace are out."""
    with style():
        (figure,) = draw_time_series(ResultsFolder(stored), trials, CROSSING, target)
    columns = {axis.get_title(): curves([axis]) for axis in drawn[0].axes}
    errors = columns["position error [mm]"]
    speeds = columns["largest joint speed over limit"]
    assert errors.keys() == speeds.keys() == set(LAWS)
    for number, formulation in enumerate(LAWS):
        motion = stored_motion(stored, number)
        limit = motion.scenario.robot.limits.velocity
        assert limit is not None
        assert errors[formulation].get_ydata().max() == 1e3 * motion.position_error.max()
        assert speeds[formulation].get_ydata().max() == limit.usage(motion.trace.applied).max()
    assert (target / figure.file).stat().st_size < 100_000


def test_the_contour_error_stands_beside_it_where_there_is_a_path(
    stored: Path,
    trials: pd.DataFrame,
    drawn: list[Any],
    target: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A contour error that differs from the position error has panels of its own."""
    half = property(lambda motion: 0.5 * motion.position_error)
    monkeypatch.setattr(Motion, "contour_error", half)
    with style():
        draw_time_series(ResultsFolder(stored), trials, CROSSING, target)
    errors, contours, _ = (curves([axis]) for axis in drawn[0].axes[:3])
    for formulation in LAWS:
        assert (
            0.5 * errors[formulation].get_ydata().max() == contours[formulation].get_ydata().max()
        )


def test_margins_are_distances_to_the_nearest_limit(
    stored: Path, trials: pd.DataFrame, drawn: list[Any], target: Path
) -> None:
    """The crossing is found whatever the example is; its margins go through the crossing."""
    trials = pd.concat([trials.assign(scenario="reach", scenario_family="reach"), trials])
    with style():
        (figure,) = draw_joint_margins(ResultsFolder(stored), trials, "reach", target)
    shown = curves(drawn[0].axes)
    assert shown.keys() == set(LAWS)
    for number, formulation in enumerate(LAWS):
        margin = joint_margin(stored_motion(stored, number))
        assert shown[formulation].get_ydata().min() == margin.min() < 0.0
        assert shown[formulation].get_ydata()[0] == margin[0] > 0.0
    assert (target / figure.png).is_file()


def test_margins_by_hand() -> None:
    """At the middle of its range a joint is half of the range away, outside it is negative."""
    motion = motion_of_joints([[0.0] * 6, [0.0, 6.0, 0.0, 0.0, 0.0, 0.0], [7.0] + [0.0] * 5])
    position = motion.scenario.robot.limits.position
    assert position is not None
    upper = position.upper
    np.testing.assert_allclose(joint_margin(motion), [upper.min(), upper[1] - 6.0, upper[0] - 7.0])


def motion_of_joints(q: list[list[float]]) -> Motion:
    """A motion of the UR5 of which only the configurations matter."""
    n = len(q) - 1
    nothing = np.zeros(n)
    codes = np.zeros(n, dtype=np.int64)
    trace = Trace(
        0.01, np.array(q), np.zeros(n + 1), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)),
        codes, codes, codes, codes, nothing, nothing, nothing, nothing,
    )  # fmt: skip
    return motion_of(trace, make_scenario(CROSSING))


def test_what_cannot_be_made_again_is_left_out(
    stored: Path, trials: pd.DataFrame, target: Path
) -> None:
    """Traces of a scenario that this installation does not know give no figure, and no error."""
    folder, there = ResultsFolder(stored), trials.assign(scenario="of-another-machine[x=1]")
    with style():
        assert not draw_time_series(folder, there, "of-another-machine[x=1]", target)
        assert not draw_joint_margins(folder, there, "of-another-machine[x=1]", target)
        assert not draw_time_series(folder, trials.assign(id="none"), CROSSING, target)


def test_a_folder_with_traces_gives_both_figures(stored: Path, trials: pd.DataFrame) -> None:
    """All figures of a folder include those against time, of its example or first scenario."""
    figures = draw_figures(ResultsFolder(stored), trials, {"study": {"example": ""}})
    assert {"error_and_speed_against_time.svg", "joint_margins_against_time.svg"} <= {
        figure.file for figure in figures
    }


def test_thinning_keeps_the_extremes() -> None:
    """The largest or the smallest value of a curve survives, and its time to within a stretch."""
    values = np.sin(np.linspace(0.0, 20.0, 1234))
    for extreme, of in ((np.fmax, np.argmax), (np.fmin, np.argmin)):
        times, kept = thinned(values, 0.01, 50, extreme)
        assert len(kept) == 50
        assert kept[of(kept)] == values[of(values)]
        assert 0.0 <= 0.01 * of(values) - times[of(kept)] <= 0.01 * 25
    times, kept = thinned(values[:7], 0.01, 50)
    np.testing.assert_array_equal(kept, values[:7])


def test_no_panel_has_too_many_curves() -> None:
    """Names are dealt out in their order, five to a panel."""
    assert in_panels(list("abcdefg")) == [list("abcde"), list("fg")]
