"""Metrics of a run: values of a motion made by hand, and what is undefined."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from makers.tip_motions import ELBOW, RADIUS, J, four_steps, tip_scenario, trace_of

from dikbench.metrics import METRICS, evaluate, motion_of
from dikbench.metrics.distance_and_torque import CONSTRAINTS
from dikbench.simulation.status import Status


def _chord(angle: float) -> float:
    """How far the tip is from where it was, after a turn about the base."""
    return 2 * RADIUS * math.sin(abs(angle) / 2)


def _rms(*values: float) -> float:
    return math.sqrt(sum(value**2 for value in values) / len(values))


def _arc(magnitudes: list[float]) -> float:
    """Length of a curve through equally spaced points over a unit."""
    width = 1 / (len(magnitudes) - 1)
    return sum(math.hypot(width, b - a) for a, b in pairwise(magnitudes))


ERRORS = (0, _chord(0.1), _chord(0.1), _chord(0.2), _chord(0.2))
ANGLES = (0, 0.1, 0.1, 0.2, 0.2)
BOTH_ERRORS = [
    math.hypot(error, 2 * 0.2 * math.sin(angle / 2))
    for error, angle in zip(ERRORS, ANGLES, strict=True)
]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("position_error_rms_m", _rms(*ERRORS)),
        ("position_error_p95_m", _chord(0.2)),
        ("position_error_max_m", _chord(0.2)),
        ("position_error_final_m", _chord(0.2)),
        ("orientation_error_rms_rad", _rms(0, 0.1, 0.1, 0.2, 0.2)),
        ("orientation_error_p95_rad", 0.2),
        ("orientation_error_max_rad", 0.2),
        ("orientation_error_final_rad", 0.2),
        ("second_task_error_rms", _rms(0, *(ELBOW * _chord(a) for a in (0.1, 0.1, 0.2, 0.2)))),
        ("second_task_error_final", ELBOW * _chord(0.2)),
        ("tracking_error_6d_rms_m", _rms(*BOTH_ERRORS)),
        ("tracking_error_6d_p95_m", BOTH_ERRORS[-1]),
        ("tracking_error_6d_max_m", BOTH_ERRORS[-1]),
        ("tracking_error_6d_final_m", BOTH_ERRORS[-1]),
        # A target at rest has no path but itself.
        ("contour_error_6d_rms_m", _rms(*BOTH_ERRORS)),
        ("contour_error_6d_p95_m", BOTH_ERRORS[-1]),
        ("contour_error_6d_max_m", BOTH_ERRORS[-1]),
        ("contour_error_6d_final_m", BOTH_ERRORS[-1]),
        ("path_done_99_tolerance_m", math.nan),
        ("path_done_90_tolerance_m", math.nan),
        ("lag_tolerance_m", math.nan),
        ("slow_down", math.nan),
        ("course_rad", math.nan),
        # Only one change of velocity, by -3 rad/s in 0.1 s, is above 20 rad/s^2.
        ("chatter_share", 0.0),
        ("chatter_steps", 0.0),
        ("freeze_events", 0.0),  # its target rests
        ("contour_error_rms_m", _rms(*ERRORS)),
        ("contour_error_p95_m", _chord(0.2)),
        ("contour_error_max_m", _chord(0.2)),
        ("contour_error_final_m", _chord(0.2)),
        ("path_done_share", math.nan),
        ("lag_max_s", math.nan),
        ("lag_final_s", math.nan),
        ("null_space_drift_per_lap_rad", math.nan),
        ("recovery_time_s", math.inf),
        ("path_length_m", 2 * _chord(0.1) + _chord(0.2)),
        ("direction_error_max_rad", math.pi),
        ("progress_mean", (1.0 - 2.0 + 0.5 + 0.0) / 4),
        ("progress_min", -2.0),
        ("velocity_peak_ratio", 2.0 / 1.5),
        ("position_violation_max_rad", 0.05),
        ("position_violation_share", 1 / 4),
        ("position_violation_integral_rad_s", 0.05 * 0.1),
        ("velocity_violation_max_rad_s", 0.5),
        ("velocity_violation_share", 1 / 4),
        ("velocity_violation_integral_rad", 0.5 * 0.1),
        # Speeds 0.5 (before), 1, -2, -1, 0: accelerations 5, -30, 10, 10.
        ("acceleration_violation_max_rad_s2", 10.0),
        ("acceleration_violation_share", 1 / 4),
        ("acceleration_violation_integral_rad_s", 10.0 * 0.1),
        ("violating_share", 2 / 4),  # the first ends beyond a limit, the second is too fast
        # Jerks -350, 400, 0; 0.4 s; q_1 between -0.2 and 0.1.
        ("jerk_rms_scaled", _rms(350, 400, 0) * 0.4**3 / 0.3),
        ("acceleration_variation_rad_s2", 35 + 40 + 0),
        ("reversals_per_s", 2 / 0.4),
        ("energy_above_10_hz_share", math.nan),  # ten steps a second
        # |FFT| of speeds 1, 2, 1, 0 is 2 + 2 cos w, at w = 2 pi k/64, and above 5 % of its largest
        # up to k = 27.
        ("sparc", -_arc([(1 + math.cos(2 * math.pi * k / 64)) / 2 for k in range(28)])),
        ("feasible_share", 1 / 4),
        ("infeasible_share", 1 / 4),
        ("solver_failed_share", 1 / 4),
        ("not_verified_share", 1 / 4),
        ("fallback_steps", 2),
        ("claimed_share", 2 / 3),  # of the steps at which something was solved
        ("verified_share", 1 / 3),
        ("disagreed_share", 1 / 3),
        ("optimum_distance_max_rad_s", 0.25),
        ("primal_residual_max_rad_s", 3e-3),
        ("dual_residual_max", 2e-3),
        ("gap_max", 4e-5),
        ("stuck_share", 2 / 4),  # the reversal and the stop, whatever their status
        ("relaxed_share", 2 / 4),
        ("relaxed_steps", 2),
        ("joint_travel_rad", 0.4),
        ("sigma_min", np.linalg.svd(J, compute_uv=False)[-1]),
    ],
)
def test_every_metric_of_a_motion_made_by_hand(name: str, value: float) -> None:
    """Four steps of the planar arm about its base, with the values of a pocket calculator."""
    assert four_steps()[name] == pytest.approx(value, abs=1e-12, nan_ok=True)


def test_no_metric_is_left_out_of_the_test_above() -> None:
    """A new metric needs a line there."""
    marks = test_every_metric_of_a_motion_made_by_hand.pytestmark  # type: ignore[attr-defined]
    made_elsewhere = {metric.name for metric in CONSTRAINTS}  # metrics/test_constraints.py
    assert {name for name, _ in marks[0].args[1]} == set(METRICS) - made_elsewhere


def test_a_slant_of_the_motion_is_its_largest_angle() -> None:
    """Off course by an angle between none and reversal: cosines of hand-weighted twists."""
    # Achieved (0.4, 0.5, 1), weighted (0.4, 0.5, 0.2); wanted the translation alone.
    trace = trace_of([1.0, 1.0], [[0.4, 0.5, 0.0], [0.4, 0.5, 1.0]], [Status.OK, Status.OK])
    got = evaluate(motion_of(trace, tip_scenario()))
    assert got["direction_error_max_rad"] == pytest.approx(math.acos(math.sqrt(0.41 / 0.45)))
    assert got["progress_min"] == pytest.approx(1.0)
    assert got["stuck_share"] == 0.0


def test_the_smallest_singular_value_is_that_of_the_worst_configuration() -> None:
    """Stretched, the planar arm's is zero, at the last configuration too."""
    trace = trace_of([0.0], [[1.0, 0, 0]], [Status.OK])
    trace.q[-1] = 0.0
    assert evaluate(motion_of(trace, tip_scenario()))["sigma_min"] == pytest.approx(0.0, abs=1e-12)


def test_what_a_step_achieved_is_judged_where_it_began() -> None:
    """The body Jacobian of the configuration before the step, times the velocity applied in it."""
    trace = trace_of([0.0, 0.0], [[1.0, 0, 0]] * 2, [Status.OK] * 2)
    trace.applied[0] = [3.0, -5.0, 0.0]
    trace.applied[1] = [2.0, 0.0, 0.0]
    trace.q[1:, 1] = 0.0
    motion = motion_of(trace, tip_scenario())
    assert motion.achieved[0] == pytest.approx(3.0 * J[:, 0] - 5.0 * J[:, 1])
    # Stretched: the tip is 0.9 m straight ahead of the base.
    assert motion.achieved[1] == pytest.approx([0.0, 1.8, 2.0])


NEED_MORE = {
    "path_done_share": "a path",
    "path_done_99_tolerance_m": "a path",
    "path_done_90_tolerance_m": "a path",
    "lag_tolerance_m": "a path",
    "slow_down": "a path that waits",
    "course_rad": "a path",
    "lag_max_s": "a path",
    "lag_final_s": "a path",
    "null_space_drift_per_lap_rad": "a lap",
    "jerk_rms_scaled": "two steps",
    "energy_above_10_hz_share": "0.2 s",
    **{metric.name: "a constraint" for metric in CONSTRAINTS},
}


@pytest.mark.parametrize("name", METRICS)
def test_one_step_defines_every_metric_that_does_not_need_more(name: str) -> None:
    """The shortest run that there is."""
    trace = trace_of([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    trace.dual[0] = 0.0
    assert math.isnan(evaluate(motion_of(trace, tip_scenario()))[name]) == (name in NEED_MORE)


def test_no_step_leaves_what_it_cannot_define() -> None:
    """A trial that ended at step 0: errors at the start, no travel, NaN for shares and progress."""
    trace = trace_of([], [], [])
    got = evaluate(motion_of(trace, tip_scenario()))
    assert list(got) == list(METRICS)
    for name, value in got.items():
        defined = ("error" in name and "direction" not in name) or name in {
            "joint_travel_rad", "sigma_min", "position_violation_max_rad", "path_length_m",
            "fallback_steps", "relaxed_steps", "chatter_steps", "acceleration_variation_rad_s2",
            "freeze_events",
        } or "integral" in name  # fmt: skip
        assert math.isnan(value) != defined, name
    assert got["position_error_max_m"] == pytest.approx(0.0, abs=1e-12)
    assert got["joint_travel_rad"] == 0.0


def test_a_run_that_only_dwells_has_no_progress() -> None:
    """Nothing was wanted at any step: NaN, and no warning about empty means."""
    trace = trace_of([0.0, 0.0], [[0.0, 0.0, 0.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, tip_scenario()))
    assert math.isnan(got["progress_mean"])
    assert math.isnan(got["progress_min"])
    assert math.isnan(got["direction_error_max_rad"])


def test_a_run_that_stands_still_makes_no_progress() -> None:
    """Progress 0, no direction: stopped is not on course."""
    trace = trace_of([0.0, 0.0], [[0.4, 0.5, 1.0]] * 2, [Status.STUCK] * 2)
    got = evaluate(motion_of(trace, tip_scenario()))
    assert got["progress_mean"] == 0.0
    assert math.isnan(got["direction_error_max_rad"])
    assert got["stuck_share"] == 1.0
