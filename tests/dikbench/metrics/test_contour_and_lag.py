"""Off the path and late on it, each without the other: motions made by hand along known curves."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from makers.frame_motions import (
    DT,
    EIGHT,
    PERIOD,
    ROUND,
    ROUND_TWICE,
    SAMPLE_S,
    TOLERANCE,
    back_and_forth,
    of,
    on,
    straight,
    with_dwell,
)

from dikbench.arrays import Array
from dikbench.metrics import evaluate
from dikbench.problem.tasks import OrientationTask
from dikbench.scenario.reference.reference import Reference, target_at_rest


def test_the_share_of_the_path_that_is_done() -> None:
    """Of a line of 2 s: 0.5 s late a quarter is left; of two laps at rest from 1.5 s on 5/8 is.

    Less the tolerance of 5 mm. Shifted sideways all is done; on a way back as long as the way out
    the half is not the whole.
    """

    def done(reference: Reference, place: Callable[[float], Array]) -> float:
        return evaluate(of(reference, place))["path_done_share"]

    assert done(straight(), on(straight(), 0.5)) == pytest.approx(
        0.75 + TOLERANCE / 0.6, abs=1.3e-3
    )
    assert done(straight(), on(straight(), shift=np.array([0, 3e-3, 0]))) == pytest.approx(1.0)
    rests = on(ROUND)
    assert done(ROUND, lambda t: rests(min(t, 1.5))) == pytest.approx(
        3 / 8 + TOLERANCE / ROUND_TWICE, abs=1.3e-3
    )
    back = on(back_and_forth())
    assert done(back_and_forth(), lambda t: back(min(t, 2.0))) == pytest.approx(0.505, abs=1.3e-3)
    assert done(back_and_forth(), back) == pytest.approx(1.0, abs=1e-4)
    turned = of(straight(), on(straight()), tracking=OrientationTask())
    assert math.isnan(evaluate(turned)["path_done_share"])


@pytest.mark.parametrize("reference", [straight(), ROUND, EIGHT], ids=["line", "circle", "eight"])
@pytest.mark.parametrize("delay", [0.0, 0.1, 0.237])
def test_a_frame_that_is_late_on_the_path_has_lag_and_no_contour_error(
    reference: Reference, delay: float
) -> None:
    """The lag is the delay less the time of the tolerance; pieces are within a micron."""
    got = evaluate(of(reference, on(reference, delay)))
    speed = float(np.linalg.norm(reference.velocity(reference.duration - delay)[:3]))
    expected = max(delay - TOLERANCE / speed, 0.0)
    assert got["lag_final_s"] == pytest.approx(expected, abs=2 * SAMPLE_S)
    assert expected - 2 * SAMPLE_S <= got["lag_max_s"] <= delay
    assert got["contour_error_max_m"] < 2e-6
    assert got["contour_error_6d_max_m"] < 1e-5
    assert delay == 0.0 or got["position_error_max_m"] > 0.02


def test_a_frame_beside_a_line_has_contour_error_and_no_lag() -> None:
    """3 mm to the side, all the way."""
    got = evaluate(of(straight(), on(straight(), 0.0, np.array([0.0, 3e-3, 0.0]))))
    for name in ("rms", "p95", "max", "final"):
        assert got[f"contour_error_{name}_m"] == pytest.approx(3e-3, abs=1e-9)
    assert got["lag_max_s"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("radius", [0.097, 0.103])
def test_a_frame_inside_or_outside_a_circle_has_contour_error_and_no_lag(radius: float) -> None:
    """On a circle about the same centre, 3 mm smaller or larger than 0.1 m."""

    def place(t: float) -> Array:
        angle = 2 * math.pi / PERIOD * t
        return np.array([0.0, radius * math.sin(angle), 0.1 - radius * math.cos(angle)])

    got = evaluate(of(ROUND, place))
    assert got["contour_error_rms_m"] == pytest.approx(3e-3, abs=2e-6)
    assert got["contour_error_max_m"] == pytest.approx(3e-3, abs=2e-6)
    assert got["lag_max_s"] == pytest.approx(0.0, abs=1e-4)


def test_off_the_path_and_late_are_distinguished_in_one_motion() -> None:
    """0.1 s late and 3 mm to the side: both, each at its value; the quantile is the 95th."""
    got = evaluate(of(straight(), on(straight(), 0.1, np.array([0.0, 0.0, 3e-3]))))
    assert got["contour_error_max_m"] == pytest.approx(3e-3, abs=1e-9)
    # Within 5 mm of a sample, 3 mm to the side, it is from 4 mm before it on.
    assert got["lag_final_s"] == pytest.approx(0.1 - 4e-3 / 0.3, abs=1.1 * SAMPLE_S)
    # 200 steps, the excursion rising from 0 to 2 cm: of 201 samples the quantile is the 190th step.
    rising = evaluate(of(straight(), lambda t: np.array([0.3 * t, 0.01 * t, 0.0])))
    assert rising["contour_error_p95_m"] == pytest.approx(0.019, abs=1e-9)


def test_the_nearest_point_may_be_where_the_target_is_not() -> None:
    """Contour error is the distance from the set: far ahead or a lap behind count as well."""
    ahead = evaluate(of(straight(), lambda t: np.array([0.45, 0.0, 0.02])))
    assert ahead["contour_error_max_m"] == pytest.approx(0.02, abs=1e-9)
    late = evaluate(of(ROUND, on(ROUND, PERIOD)))
    assert late["contour_error_max_m"] < 2e-6
    assert late["position_error_final_m"] < 1e-9


@pytest.mark.parametrize("point", [0.0, 0.4, 1.13])
def test_a_frame_that_rests_while_the_target_laps_it_is_late_by_laps(point: float) -> None:
    """It stops on the circle, and nearest points of the next laps are not taken for its own."""
    stop = ROUND.placement(point).translation
    got = evaluate(of(ROUND, lambda t: ROUND.placement(t).translation if t < point else stop))
    near = TOLERANCE / (0.1 * math.pi)
    assert got["lag_final_s"] == pytest.approx(2 * PERIOD - point - near, abs=1.1 * SAMPLE_S)
    assert got["contour_error_max_m"] < 2e-6


def test_a_crossing_does_not_lead_onto_the_other_branch() -> None:
    """Late by more than half a figure of eight, past its middle: still on its own branch."""
    delay = 0.6 * PERIOD
    shifted = of(EIGHT, on(EIGHT, delay, np.array([5e-4, 0.0, 0.0])))
    assert delay - 0.03 < evaluate(shifted)["lag_max_s"] <= delay
    along = shifted.along_path
    assert along is not None
    assert np.all(np.diff(along.lag) < DT + 1e-9)


def test_a_way_back_that_begins_too_early_is_found() -> None:
    """The frame turns 2 cm before the end of its line: no more is covered within less."""
    turn = 0.48

    def place(t: float) -> Array:
        late = max(t - 0.08, 0.0)  # 2 cm at 0.25 m/s
        return np.array([max(turn - abs(turn - 0.25 * late), 0.0), 0.0, 0.0])

    got = evaluate(of(back_and_forth(), place))
    assert got["contour_error_max_m"] < 1e-9
    assert got["path_done_share"] == pytest.approx(turn + TOLERANCE, abs=1.3e-3)
    assert got["path_done_99_tolerance_m"] == pytest.approx(0.5 - turn, abs=1.3e-3)


def test_a_frame_that_is_pushed_back_falls_behind_and_its_nearest_point_stays() -> None:
    """At 0.3 m after 1 s, then back at half the speed: of 1 s that is left, 1 s of delay."""

    def place(t: float) -> Array:
        return np.array([0.3 * min(t, 1.0) - 0.15 * max(t - 1.0, 0.0), 0.0, 0.0])

    got = evaluate(of(straight(), place))
    # The target leaves as the frame turns: of 5 mm it is given those that are there in a period.
    assert got["lag_final_s"] == pytest.approx(0.99, abs=1.1 * SAMPLE_S)
    assert got["contour_error_max_m"] < 1e-9


def test_a_dwell_is_no_delay() -> None:
    """Short of where the target rests, but within the tolerance, the frame is not late there."""
    reference = with_dwell()

    def place(t: float) -> Array:
        x = reference.placement(t).translation[0]
        return np.array([min(x, 0.299), 0.0, 0.0])

    along = of(reference, place).along_path
    assert along is not None
    assert along.lag[150] == 0.0
    assert along.lag[-1] == pytest.approx((0.301 - TOLERANCE) / 0.3, abs=1.1 * SAMPLE_S)


def test_a_target_that_waits_is_late_itself() -> None:
    """A path-indexed run that makes half the way per step does not come to the end in time."""
    tau = 0.5 * DT * np.arange(201.0)
    motion = of(straight(), lambda t: np.array([0.15 * t, 0.0, 0.0]), tau)
    got = evaluate(motion)
    assert got["position_error_max_m"] == pytest.approx(0.0, abs=1e-12)
    assert math.isnan(got["lag_final_s"])
    assert got["slow_down"] == math.inf
    assert got["path_done_share"] == pytest.approx(0.5 + TOLERANCE / 0.6, abs=1.3e-3)


def test_a_target_at_rest_has_itself_for_a_path_and_nothing_to_be_late_on() -> None:
    """The contour error is the position error, the lag is not defined."""
    target = target_at_rest(pin.SE3.Identity(), 1.0)
    got = evaluate(of(target, lambda t: np.array([0.1 * t, 0.0, 0.0])))
    assert got["contour_error_final_m"] == got["position_error_final_m"] == pytest.approx(0.1)
    assert math.isnan(got["lag_max_s"])
    assert math.isnan(got["lag_final_s"])


def test_a_rotation_in_place_is_a_path_of_orientations() -> None:
    """A turn of 1 rad that the frame makes as well, but on its way elsewhere, 0.2 m in all."""
    turning = Reference(
        1.0,
        lambda tau: pin.SE3(pin.utils.rotate("z", tau), np.zeros(3)),
        lambda tau: np.array([0, 0, 0, 0, 0, 1.0]),
    )
    got = evaluate(of(turning, lambda t: np.array([0.0, 0.2 * t, 0.0])))
    assert got["contour_error_max_m"] == pytest.approx(0.2)
    assert got["contour_error_6d_max_m"] == pytest.approx(0.2, abs=1e-6)
    assert got["lag_final_s"] > 0.9


def test_an_orientation_task_has_neither() -> None:
    """Where the origin is does not matter to it."""
    got = evaluate(of(straight(), on(straight(), 0.1), tracking=OrientationTask()))
    of_position = [name for name in got if "contour" in name and "6d" not in name]
    assert all(math.isnan(got[name]) for name in of_position)
    assert got["contour_error_6d_max_m"] == pytest.approx(0.0, abs=1e-9)
    assert math.isnan(got["lag_max_s"])


def test_recovery_is_timed_from_the_largest_error() -> None:
    """Largest at 0.3 s, below 1 mm for a while, above again, and for good from 0.8 s on."""

    def errors(t: float) -> float:
        if round(t, 2) == 0.3:
            return 0.05
        return 0.002 if 0.2 <= round(t, 2) < 0.5 or 0.6 <= round(t, 2) < 0.8 else 0.0005

    target = target_at_rest(pin.SE3.Identity(), 1.0)
    got = evaluate(of(target, lambda t: np.array([errors(t), 0.0, 0.0])))
    assert got["recovery_time_s"] == pytest.approx(0.5)
    never = evaluate(of(target, lambda t: np.array([0.002 * t, 0.0, 0.0])))
    assert never["recovery_time_s"] == math.inf
    quiet = evaluate(of(target, lambda t: np.array([0.0009, 0.0, 0.0])))
    assert math.isnan(quiet["recovery_time_s"])


def test_the_lag_does_not_depend_on_how_finely_the_run_is_sampled() -> None:
    """A run of 5000 steps, of which only some are looked at closely, has every step's lag."""
    slow = straight(50.0, 0.012)
    motion = of(slow, on(slow, 0.1))
    assert motion.along_path is not None
    # Of 5000 steps 8000 samples are taken, 6.25 ms apart; 5 mm are done in 0.42 s.
    np.testing.assert_array_equal(motion.along_path.lag, 0.0)
    later = of(slow, on(slow, 0.6)).along_path
    assert later is not None
    expected = 0.6 - TOLERANCE / 0.012
    np.testing.assert_allclose(later.lag[70:], expected, atol=6.25e-3 + DT)
