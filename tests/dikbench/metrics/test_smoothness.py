"""Smoothness: closed forms of motions that are known, and that chatter is seen where it is."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.metrics import METRICS, Motion
from dikbench.metrics.sparc import sparc
from dikbench.problem.tasks import PoseTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.scenario.reference.reference import target_at_rest
from dikbench.simulation.trace import Trace

ROBOT = load_robot("planar3r")


def of(name: str, v: Array, dt: float, start: float = 0.0) -> float:
    """A metric of a motion of which only the velocities are known: of joint 1, or (n, 3)."""
    applied = np.zeros((len(v), 3))
    if v.ndim == 1:
        applied[:, 0] = v
    else:
        applied[:] = v
    n, nothing, none = len(v), np.zeros(len(v)), np.zeros(len(v), dtype=int)
    trace = Trace(
        dt, np.zeros((n + 1, 3)), dt * np.arange(n + 1.0), applied, applied, applied, none, none,
        none, none, nothing, nothing, nothing, nothing,
    )  # fmt: skip
    scenario = Scenario(
        ROBOT, ROBOT.q0, np.array([start, 0.0, 0.0]), target_at_rest(pin.SE3.Identity(), 1.0),
        PoseTask(), dt, 1.0, Certificate(()),
    )  # fmt: skip
    nowhere = np.zeros(n + 1)
    return METRICS[name].of(
        Motion(
            trace,
            scenario,
            np.zeros((n + 1, 3)),
            nowhere,
            nowhere,
            np.zeros((n + 1, 3, 3)),
            nowhere,
            nowhere,
        )
    )


def minimum_jerk(duration: float, amplitude: float, dt: float) -> Array:
    """Speeds of the movement of least jerk from rest to rest, 30 A/T u^2 (1 - u)^2."""
    u = np.arange(1, round(duration / dt) + 1) * dt / duration
    speeds: Array = 30 * amplitude / duration * u**2 * (1 - u) ** 2
    return speeds


@pytest.mark.parametrize("duration", [0.5, 2.0])
@pytest.mark.parametrize("amplitude", [0.01, 1.5])
def test_the_scaled_jerk_of_a_minimum_jerk_movement_is_the_root_of_720(
    duration: float, amplitude: float
) -> None:
    """Whatever its duration and amplitude (Hogan & Sternad 2009: 720 A^2/T^5 for its integral)."""
    v = minimum_jerk(duration, amplitude, duration / 2000)
    found = of("jerk_rms_scaled", v, duration / 2000)
    assert found == pytest.approx(math.sqrt(720), rel=2e-3)


def test_the_scaled_jerk_takes_all_joints_together() -> None:
    """Two joints that do the same: jerk and amplitude grow alike; a third at rest adds nothing."""
    v = minimum_jerk(1.0, 0.5, 1e-3)
    both = np.column_stack([v, -v, np.zeros(len(v))])
    assert of("jerk_rms_scaled", both, 1e-3) == pytest.approx(of("jerk_rms_scaled", v, 1e-3))


def test_the_variation_of_a_bang_bang_motion_is_the_sum_of_its_jumps() -> None:
    """Accelerations of 0, 3, 0, -3, 0 rad/s^2, however long each lasts: four jumps of 3."""
    a = np.repeat([0.0, 3.0, 0.0, -3.0, 0.0], 7)
    v = np.cumsum(a) * 0.01
    assert of("acceleration_variation_rad_s2", v, 0.01) == pytest.approx(12.0)


def test_reversals_are_counted_beyond_the_dead_band_of_the_joint_with_most_of_them() -> None:
    """Accelerations of 1, -1 by turns, 9 flips in 0.1 s; of 0.09 none; zeros between do not count.

    A motion that begins with the speed that it has does not reverse.
    """
    dt = 0.01
    by_turns = np.array([1.0, -1.0] * 5)
    assert of("reversals_per_s", np.cumsum(by_turns) * dt, dt) == pytest.approx(90.0)
    assert of("reversals_per_s", np.cumsum(0.09 * by_turns) * dt, dt) == 0.0
    paused = np.array([1.0, 0, 0, -1.0, 0.05, -0.05, -1.0, 0, 0, 1.0])
    assert of("reversals_per_s", np.cumsum(paused) * dt, dt) == pytest.approx(20.0)
    two = np.column_stack([np.cumsum(paused) * dt, np.cumsum(by_turns) * dt, np.zeros(10)])
    assert of("reversals_per_s", two, dt) == pytest.approx(90.0)
    assert of("reversals_per_s", np.full(10, 0.7), dt, start=0.7) == 0.0


@pytest.mark.parametrize(("amplitude", "share"), [(0.0, 0.0), (0.5, 0.2), (1.0, 0.5), (2.0, 0.8)])
@pytest.mark.parametrize("frequency", [20.0, 37.0, 50.0])
def test_the_energy_above_10_hz_is_that_of_the_fast_sine(
    amplitude: float, share: float, frequency: float
) -> None:
    """A sine of 3 Hz and 1 rad/s beside a fast one: A^2 / (1 + A^2), a drift taken off.

    At half the sampling rate, 50 Hz, a cosine has twice the energy: it is made smaller here.
    """
    t = np.arange(400) * 0.01
    size = amplitude / math.sqrt(2) if frequency == 50.0 else amplitude
    fast = size * np.cos(2 * np.pi * frequency * t)
    v = np.sin(2 * np.pi * 3 * t) + fast + 0.3 * t - 2
    assert of("energy_above_10_hz_share", v, 0.01) == pytest.approx(share, abs=3e-3)


def test_a_steady_motion_has_no_energy_above_10_hz() -> None:
    """At rest, at constant speed, at constant acceleration: 0, not a ratio of roundings."""
    for v in (np.zeros(100), np.full(100, 0.3), np.linspace(0, 1, 100)):
        assert of("energy_above_10_hz_share", v, 0.01) == 0.0
        assert of("energy_above_10_hz_share", v + 1e-12 * np.arange(100) % 2, 0.01) == 0.0


def test_runs_without_such_frequencies_have_no_energy_there_to_speak_of() -> None:
    """Less than 0.2 s, or 20 Hz and slower: NaN."""
    v = np.array([1.0, -1.0] * 10)
    assert math.isnan(of("energy_above_10_hz_share", v[:19], 0.01))
    assert of("energy_above_10_hz_share", v, 0.01) > 0.99
    assert math.isnan(of("energy_above_10_hz_share", v, 0.05))


def test_sparc_is_that_of_its_authors() -> None:
    """A bell exp(-5 t^2) from -1 to 1 s at 100 Hz: -1.41403 in their own example."""
    t = np.arange(-1, 1, 0.01)
    assert round(sparc(np.exp(-5 * t**2), 0.01), 5) == -1.41403


def test_sparc_does_not_see_what_a_control_loop_does() -> None:
    """Chatter of 40 Hz, half the speed, changes it by nothing; the energy above 10 Hz tells."""
    t = np.arange(-1, 1, 0.01)
    smooth = np.exp(-5 * t**2)
    rough = smooth * (1 + 0.5 * np.cos(2 * np.pi * 40 * t))
    assert of("sparc", rough, 0.01) == pytest.approx(of("sparc", smooth, 0.01), abs=1e-5)
    assert of("energy_above_10_hz_share", smooth, 0.01) < 1e-6
    assert of("energy_above_10_hz_share", rough, 0.01) > 0.1


def test_sparc_takes_the_length_of_the_joint_velocity() -> None:
    """Speeds of 3 and 4 by a bell are a speed of 5; the scale does not matter."""
    bell = np.exp(-5 * np.arange(-1, 1, 0.01) ** 2)
    v = np.column_stack([3 * bell, -4 * bell, 0 * bell])
    assert of("sparc", v, 0.01) == pytest.approx(-1.41403, abs=1e-5)
