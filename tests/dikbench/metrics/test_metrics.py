"""Metrics of a run: values of a motion made by hand, and what is undefined."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from dikbench.metrics import METRICS, evaluate, motion_of
from dikbench.metrics.distance_and_torque import CONSTRAINTS
from dikbench.problem.tasks import PoseTask, PositionTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace

# --- metrics of a motion made by hand
#
# The planar arm at q = (q_1, 90 deg, 0): its tip is at (0.4, 0.5), 0.41^(1/2) m from the base,
# turned by q_1 and pointing 90 deg to the left. A speed w of joint 1 moves it, in its own axes,
# with (0.4, 0.5, 1) w; the body Jacobian depends on q_2 and q_3 only.

J = np.array([[0.4, 0.0, 0.0], [0.5, 0.5, 0.2], [1.0, 1.0, 1.0]])
STEP = J[:, 0]
RADIUS = math.sqrt(0.41)
ELBOW = 0.4 / RADIUS  # the end of the first link, at 0.4 m, is the second task's


def _scenario() -> Scenario:
    """Hold tip and elbow where they are at q_1 = 0; limits of 0.05 rad, 1.5 rad/s, 20 rad/s^2."""
    robot = load_robot("planar3r").with_limits(
        position=([-0.25, -2, -2], [0.05, 2, 2]), velocity=(-1.5, 4.0), acceleration=20.0
    )
    target = pin.SE3(pin.utils.rotate("z", np.pi / 2), np.array([0.4, 0.5, 0.0]))
    return Scenario(
        robot=robot,
        q0=np.array([0.0, np.pi / 2, 0.0]),
        v0=np.array([0.5, 0.0, 0.0]),
        reference=target_at_rest(target, 0.4),
        tracking=PoseTask(gain=1.0),
        dt=0.1,
        duration=0.4,
        certificate=Certificate(()),
        tasks=(PositionTask(target=np.array([0.4, 0.0, 0.0]), frame="link1", priority=2),),
    )


def _trace(speeds: list[float], wanted: list[list[float]], statuses: list[Status]) -> Trace:
    """Joint 1 moves at the given speeds from q_1 = 0 on, for 0.1 s each."""
    n = len(speeds)
    q = np.zeros((n + 1, 3))
    q[:, 0] = np.concatenate([[0.0], np.cumsum(speeds)]) * 0.1
    q[:, 1] = np.pi / 2
    applied = np.zeros((n, 3))
    applied[:, 0] = speeds
    return Trace(
        dt=0.1,
        q=q,
        tau=0.1 * np.arange(n + 1.0),
        wanted=np.array(wanted).reshape(n, 3),
        commanded=applied + 100.0,  # nothing may be read off the command
        applied=applied,
        status=np.array([STEP_CODE[s] for s in statuses], dtype=int),
        relaxed=np.array([0, 2, 0, 1][:n], dtype=int),
        claimed=np.array([1, 0, 1, -1][:n], dtype=int),
        verified=np.array([1, 0, 0, -1][:n], dtype=int),
        # Of the last step, at which nothing was solved, no residual counts.
        primal=np.array([1e-9, 3e-3, 2e-3, 9.0][:n], dtype=float),
        dual=np.array([np.nan, 1e-3, 2e-3, 9.0][:n], dtype=float),
        gap=np.array([0.0, 4e-5, 1e-5, 9.0][:n], dtype=float),
        distance=np.array([0.0, 0.25, 0.125, np.nan][:n]),
    )


def _four_steps() -> dict[str, float]:
    """q_1 = 0, 0.1, -0.1, -0.2, -0.2: forward, back too fast, back, stopped."""
    trace = _trace(
        speeds=[1.0, -2.0, -1.0, 0.0],
        wanted=[
            [0.4, 0.5, 1.0],  # done as wanted
            [0.4, 0.5, 1.0],  # twice as fast, in reverse
            [-0.8, -1.0, -2.0],  # half of it
            [0.4, 0.5, 1.0],  # nothing of it
        ],
        statuses=[Status.OK, Status.SOLVER_FAILED, Status.NOT_VERIFIED, Status.INFEASIBLE],
    )
    return evaluate(motion_of(trace, _scenario()))


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
    assert _four_steps()[name] == pytest.approx(value, abs=1e-12, nan_ok=True)


def test_no_metric_is_left_out_of_the_test_above() -> None:
    """A new metric needs a line there."""
    marks = test_every_metric_of_a_motion_made_by_hand.pytestmark  # type: ignore[attr-defined]
    made_elsewhere = {metric.name for metric in CONSTRAINTS}  # metrics/test_constraints.py
    assert {name for name, _ in marks[0].args[1]} == set(METRICS) - made_elsewhere


def test_a_slant_of_the_motion_is_its_largest_angle() -> None:
    """Off course by an angle between none and reversal: cosines of hand-weighted twists."""
    # Achieved (0.4, 0.5, 1), weighted (0.4, 0.5, 0.2); wanted the translation alone.
    trace = _trace([1.0, 1.0], [[0.4, 0.5, 0.0], [0.4, 0.5, 1.0]], [Status.OK, Status.OK])
    got = evaluate(motion_of(trace, _scenario()))
    assert got["direction_error_max_rad"] == pytest.approx(math.acos(math.sqrt(0.41 / 0.45)))
    assert got["progress_min"] == pytest.approx(1.0)
    assert got["stuck_share"] == 0.0


def test_the_smallest_singular_value_is_that_of_the_worst_configuration() -> None:
    """Stretched, the planar arm's is zero, at the last configuration too."""
    trace = _trace([0.0], [[1.0, 0, 0]], [Status.OK])
    trace.q[-1] = 0.0
    assert evaluate(motion_of(trace, _scenario()))["sigma_min"] == pytest.approx(0.0, abs=1e-12)


def test_what_a_step_achieved_is_judged_where_it_began() -> None:
    """The body Jacobian of the configuration before the step, times the velocity applied in it."""
    trace = _trace([0.0, 0.0], [[1.0, 0, 0]] * 2, [Status.OK] * 2)
    trace.applied[0] = [3.0, -5.0, 0.0]
    trace.applied[1] = [2.0, 0.0, 0.0]
    trace.q[1:, 1] = 0.0
    motion = motion_of(trace, _scenario())
    assert motion.achieved[0] == pytest.approx(3.0 * J[:, 0] - 5.0 * J[:, 1])
    # Stretched: the tip is 0.9 m straight ahead of the base.
    assert motion.achieved[1] == pytest.approx([0.0, 1.8, 2.0])


def test_limits_that_are_not_in_force_are_not_violated() -> None:
    """Zero, and a ratio that is not defined; the shares of violating steps are zero."""
    scenario = _scenario()
    bare = scenario.robot.with_limits(position=None, velocity=None, acceleration=None)
    trace = _trace([1.0, -2.0], [[0.4, 0.5, 1.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, replace(scenario, robot=bare)))
    assert got["position_violation_max_rad"] == 0.0
    assert got["velocity_violation_max_rad_s"] == 0.0
    assert got["acceleration_violation_max_rad_s2"] == 0.0
    assert got["violating_share"] == 0.0
    assert math.isnan(got["velocity_peak_ratio"])


def test_infinite_limits_are_not_violated() -> None:
    """Nor do they turn a ratio into NaN."""
    scenario = _scenario()
    far = scenario.robot.with_limits(position=np.inf, velocity=[np.inf, 1, 1], acceleration=np.inf)
    trace = _trace([1.0, -2.0], [[0.4, 0.5, 1.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, replace(scenario, robot=far)))
    assert got["violating_share"] == 0.0
    assert got["velocity_peak_ratio"] == 0.0
    assert got["acceleration_violation_max_rad_s2"] == 0.0


def test_a_one_sided_velocity_limit_is_a_ratio_on_its_side() -> None:
    """A joint that may only move forward, and does, at half its limit."""
    scenario = _scenario()
    forward = scenario.robot.with_limits(velocity=([0, -1, -1], 2.0))
    trace = _trace([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    got = evaluate(motion_of(trace, replace(scenario, robot=forward)))
    assert got["velocity_peak_ratio"] == pytest.approx(0.5)
    assert got["velocity_violation_max_rad_s"] == 0.0


def test_what_a_solver_leaves_is_not_a_violation() -> None:
    """A limit passed by less than 1e-4 does not make a step violate it; by more it does."""
    scenario = _scenario()
    for excess, share in ((1e-12, 0.0), (0.9e-4, 0.0), (1.1e-4, 1.0)):
        limit = scenario.robot.with_limits(
            position=([-5, -5, -5], [0.1 - excess, 5, 5]),
            velocity=1.0 - excess,
            acceleration=(0.5 - excess) / 0.1,  # from 0.5 to 1 rad/s in a step of 0.1 s
        )
        trace = _trace([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
        got = evaluate(motion_of(trace, replace(scenario, robot=limit)))
        assert got["violating_share"] == share
        for kind in ("position", "velocity", "acceleration"):
            assert got[f"{kind}_violation_share"] == share


def test_a_start_outside_a_limit_is_not_a_step_that_violates_it() -> None:
    """A step answers for where it ends."""
    scenario = _scenario()
    limit = scenario.robot.with_limits(position=([0.05, -2, -2], 2.0), velocity=2.0)
    trace = _trace([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    got = evaluate(motion_of(trace, replace(scenario, robot=limit)))
    assert got["violating_share"] == got["position_violation_share"] == 0.0
    assert got["position_violation_integral_rad_s"] == 0.0
    assert got["position_violation_max_rad"] == pytest.approx(0.05)


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
    trace = _trace([1.0], [[0.4, 0.5, 1.0]], [Status.OK])
    trace.dual[0] = 0.0
    assert math.isnan(evaluate(motion_of(trace, _scenario()))[name]) == (name in NEED_MORE)


def test_no_step_leaves_what_it_cannot_define() -> None:
    """A trial that ended at step 0: errors at the start, no travel, NaN for shares and progress."""
    trace = _trace([], [], [])
    got = evaluate(motion_of(trace, _scenario()))
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
    trace = _trace([0.0, 0.0], [[0.0, 0.0, 0.0]] * 2, [Status.OK] * 2)
    got = evaluate(motion_of(trace, _scenario()))
    assert math.isnan(got["progress_mean"])
    assert math.isnan(got["progress_min"])
    assert math.isnan(got["direction_error_max_rad"])


def test_a_run_that_stands_still_makes_no_progress() -> None:
    """Progress 0, no direction: stopped is not on course."""
    trace = _trace([0.0, 0.0], [[0.4, 0.5, 1.0]] * 2, [Status.STUCK] * 2)
    got = evaluate(motion_of(trace, _scenario()))
    assert got["progress_mean"] == 0.0
    assert math.isnan(got["direction_error_max_rad"])
    assert got["stuck_share"] == 1.0


@pytest.mark.parametrize("name", METRICS)
def test_metrics_say_what_they_are(name: str) -> None:
    """A direction, a worst value on its side, one line."""
    metric = METRICS[name]
    assert metric.name == name
    assert "\n" not in metric.definition
    value = _four_steps()[name]
    sign = 1 if metric.best == "low" else -1
    assert math.isnan(value) or sign * metric.worst >= sign * value


UNITS = {
    "_m": {"m"}, "_rad": {"rad"}, "_rad_s": {"rad/s", "rad s"}, "_rad_s2": {"rad/s^2"},
    "_s": {"s"}, "_per_s": {"1/s"}, "": {""},
}  # fmt: skip
"""What the ends of names say of units."""


@pytest.mark.parametrize("name", METRICS)
def test_the_unit_of_a_metric_is_that_at_the_end_of_its_name(name: str) -> None:
    """None where the name ends without one; the longest end counts: `_rad_s`, not `_s`."""
    end = max((suffix for suffix in UNITS if name.endswith(suffix)), key=len)
    assert METRICS[name].unit in UNITS[end]


@pytest.mark.parametrize("quantity", ["position", "velocity", "acceleration"])
def test_the_unit_of_a_time_integral_is_a_second_more(quantity: str) -> None:
    """Of `rad/s` it is `rad`."""
    units = {
        kind: metric.unit
        for kind in ("max", "integral")
        for name, metric in METRICS.items()
        if name.startswith(f"{quantity}_violation_{kind}")
    }
    times_second = {"rad": "rad s", "rad/s": "rad", "rad/s^2": "rad/s"}
    assert units["integral"] == times_second[units["max"]]
