"""A smooth path through placements: where it passes, how fast, and how near to what was sampled."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.arrays import Array
from dikbench.scenario.reference.reference import Reference
from dikbench.scenario.reference.spline import spline_through

twists = st.lists(
    st.lists(st.floats(-0.7, 0.7), min_size=6, max_size=6), min_size=2, max_size=7
).map(lambda rows: [pin.exp6(pin.Motion(np.array(row))) for row in rows])
gaps = st.lists(st.floats(0.01, 3.0), min_size=6, max_size=6)


def _times(placements: list[Any], gaps: list[float]) -> list[float]:
    return [0.0, *np.cumsum(gaps[: len(placements) - 1]).tolist()]


def _weaving(t: float) -> Any:
    """A weld: along x, weaving across, the torch turning about two axes."""
    w = 2 * np.pi * 0.7
    turn = np.array([0.4 * np.sin(w * t), 0.3 * np.cos(w * t), 0.2 * t])
    return pin.SE3(pin.exp3(turn), np.array([0.1 * t, 0.05 * np.sin(w * t), 0.03 * np.cos(w * t)]))


def _to_and_fro(t: float) -> Any:
    """A sine along x of 1 s: sampled every 20 ms, two samples stand about each turning point."""
    return pin.SE3(np.eye(3), np.array([0.1 * np.sin(2 * np.pi * t), 0.0, 0.0]))


def _sampled(path: Callable[[float], Any], period: float, duration: float = 2.0) -> Reference:
    times = [k * period for k in range(round(duration / period) + 1)]
    return spline_through(times, [path(t) for t in times])


def _velocity(path: Callable[[float], Any], tau: float, h: float = 1e-5) -> Array:
    """The body twist by central differences of placements, of the fourth order in h."""
    once, twice = (pin.log6(path(tau - d).actInv(path(tau + d))).np / (2 * d) for d in (h, 2 * h))
    V: Array = (4 * once - twice) / 3
    return V


def _largest_acceleration(reference: Reference) -> tuple[float, float]:
    """The largest rate of the linear and of the angular velocity, by differences."""
    tau, h = np.linspace(1e-4, reference.duration - 1e-4, 3001), 1e-5
    a = np.array([reference.velocity(t + h) - reference.velocity(t - h) for t in tau]) / (2 * h)
    return float(np.linalg.norm(a[:, :3], axis=1).max()), float(
        np.linalg.norm(a[:, 3:], axis=1).max()
    )


@given(twists, gaps)
def test_it_passes_every_placement_at_its_time(placements: list[Any], gaps: list[float]) -> None:
    """And stays at the last one after the end."""
    times = _times(placements, gaps)
    reference = spline_through(times, placements)
    assert reference.duration == times[-1]
    for time, placement in zip(
        [*times, times[-1] + 1.0], [*placements, placements[-1]], strict=True
    ):
        assert reference.placement(time).homogeneous == pytest.approx(
            placement.homogeneous, abs=1e-12
        )


@given(twists, gaps, st.floats(0.05, 0.95))
def test_velocity_is_the_derivative_of_the_placement(
    placements: list[Any], gaps: list[float], share: float
) -> None:
    """The body twist within every segment, by central differences."""
    times = _times(placements, gaps)
    reference = spline_through(times, placements)
    for here, there in pairwise(times):
        tau = here + share * (there - here)
        twist = _velocity(reference.placement, tau, 1e-4 * (there - here))
        scale = 1.0 + float(np.abs(twist).max())
        assert reference.velocity(tau) / scale == pytest.approx(twist / scale, abs=1e-7)


@given(twists, gaps)
def test_the_velocity_is_continuous_at_every_row(placements: list[Any], gaps: list[float]) -> None:
    """Whatever the rows: from before a row to after it there is no jump."""
    times = _times(placements, gaps)
    reference = spline_through(times, placements)
    at = [here + s * (there - here) for here, there in pairwise(times) for s in (0, 0.3, 0.5, 0.7)]
    speeds = [np.abs(reference.velocity(tau)).max() for tau in at]
    for time in times[1:-1]:
        before = time - 2e-9 - 1e-6 * min(gaps)
        jump = reference.velocity(time) - reference.velocity(before)
        assert np.abs(jump).max() <= 1e-4 * max(speeds) + 1e-12


@pytest.mark.parametrize("path", [_weaving, _to_and_fro])
def test_a_path_asks_for_the_same_accelerations_however_often_it_is_sampled(
    path: Callable[[float], Any],
) -> None:
    """Every 20 ms and every 2 ms: the same within 2 %, and those of the path."""
    coarse, fine = (np.array(_largest_acceleration(_sampled(path, h))) for h in (0.02, 0.002))
    assert coarse == pytest.approx(fine, rel=0.02, abs=1e-9)
    tau, h = np.linspace(0.01, 1.99, 1001), 1e-4
    true = np.array([_velocity(path, t + h) - _velocity(path, t - h) for t in tau]) / (2 * h)
    sizes = [np.linalg.norm(true[:, part], axis=1).max() for part in (slice(3), slice(3, 6))]
    assert fine == pytest.approx(sizes, rel=0.01, abs=1e-9)


def test_the_error_falls_with_the_fourth_power_of_the_period() -> None:
    """As that of a cubic spline does: 16 times less for half the period, from end to end."""
    tau = np.linspace(0.0, 1.999, 1501)
    errors = []
    for period in (0.04, 0.02):
        reference = _sampled(_weaving, period)
        away = [pin.log6(_weaving(t).actInv(reference.placement(t))).np for t in tau]
        errors.append(np.abs(away).max())
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] > 12


def test_it_turns_about_one_axis_at_a_constant_rate_where_the_rows_do() -> None:
    """Through angles of a radian between rows, and along a line at a constant speed."""
    axis = np.array([0.6, 0.0, 0.8])
    places = [pin.SE3(pin.exp3(k * axis), np.array([0.3 * k, 0.0, 0.0])) for k in range(5)]
    reference = spline_through([0.0, 1.0, 2.0, 3.0, 4.0], places)
    for tau in np.linspace(0.0, 3.99, 23):
        V = reference.velocity(tau)
        R = reference.placement(tau).rotation
        assert V[3:] == pytest.approx(axis, abs=1e-9)
        assert R @ V[:3] == pytest.approx([0.3, 0.0, 0.0], abs=1e-9)


def test_it_rests_between_two_rows_of_one_placement() -> None:
    """Does not swing past them, and comes to rest before: on the way on, and on the way back."""
    places = [pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])) for x in (0.0, 0.1, 0.2, 0.2, 0.2, 0.1)]
    reference = spline_through([0.0, 1.0, 2.0, 2.5, 4.0, 5.0], places)
    for tau in np.linspace(2.0, 4.0, 41):
        assert reference.placement(tau).translation[0] == 0.2
        assert np.abs(reference.velocity(tau)).max() == 0.0
    assert np.abs(reference.velocity(2.0 - 1e-6)).max() < 1e-5


@pytest.mark.parametrize("gap", [0.02, 2e-5])
@pytest.mark.parametrize("first", [1, 2, 10, 18, 19])
def test_next_to_a_jump_the_path_does_not_run_past_its_rows(first: int, gap: float) -> None:
    """A step of 0.3 m in a slow line, by rows of 20 ms or by two rows 20 microseconds apart."""
    times = [0.02 * k + (gap - 0.02) * (k >= first) for k in range(20)]
    x = [1e-4 * k + 0.3 * (k >= first) for k in range(20)]
    reference = spline_through(
        times, [pin.SE3(np.eye(3), np.array([each, 0.0, 0.0])) for each in x]
    )
    at = [reference.placement(tau).translation[0] for tau in np.linspace(0, times[-1], 2001)]
    assert np.diff(at).min() >= -1e-12
    for row in {first - 1, first} - {0, 19}:
        assert np.abs(reference.velocity(times[row])).max() < 0.05
