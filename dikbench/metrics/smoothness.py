"""How smooth the joint motion is: its jerk, its reversals, and the energy above 10 Hz."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.metrics.metric import INF, Metric
from dikbench.metrics.motion import Motion
from dikbench.metrics.sparc import sparc

ACCELERATION_DEAD_BAND_RAD_S2: Final = 0.1
"""Smaller accelerations have no sign, so that rounding is not a reversal."""

CHATTER_FREQUENCY_HZ: Final = 10.0
"""Frequency above which no scenario has desired motion."""

MIN_PERIODS: Final = 2
"""Smallest length of a run in periods of the frequency for a spectrum."""

NEGLIGIBLE_SPEED_RAD_S: Final = 1e-4
"""Variation of joint velocities below which a motion is steady."""


def jerk_rms_scaled(motion: Motion) -> float:
    """Compute the RMS jerk times T^3 / A, which compares motions of any duration and amplitude.

        sqrt(mean |j_k|^2) T^3 / A,   j_k = (v_k+1 - 2 v_k + v_k-1) / dt^2

    with T the duration and A = |max q_i - min q_i| the extent of the joint motion. It is the square
    root of the dimensionless jerk, T^5/A^2 int |j|^2 dt: 26.8 for a single minimum-jerk movement.
    NaN for fewer than two steps, and at rest.
    """
    q = np.cumsum(motion.trace.applied, axis=0) * motion.trace.dt
    extent = q.max(axis=0, initial=0.0) - q.min(axis=0, initial=0.0)
    amplitude, duration = float(np.linalg.norm(extent)), motion.trace.steps * motion.trace.dt
    jerk = motion.acceleration_changes / motion.trace.dt
    if not len(jerk) or amplitude <= NEGLIGIBLE_SPEED_RAD_S * motion.trace.dt:
        return float("nan")
    return float(np.sqrt(np.sum(np.square(jerk)) / len(jerk)) * duration**3 / amplitude)


def acceleration_variation(motion: Motion) -> float:
    """Compute the sum over joints and steps of |a_k+1 - a_k| [rad/s^2]."""
    return float(np.abs(motion.acceleration_changes).sum())


def reversals(motion: Motion) -> float:
    """Count the sign changes of dv/dt of the joint that has most of them, per second.

    Each is from one acceleration outside the dead band to the next of the other sign, however many
    inside it are between them.
    """
    if not motion.trace.steps:
        return float("nan")
    flips = 0
    for a in motion.accelerations.T:
        rising = a[np.abs(a) > ACCELERATION_DEAD_BAND_RAD_S2] > 0
        flips = max(flips, int(np.count_nonzero(rising[1:] != rising[:-1])))
    return flips / (motion.trace.steps * motion.trace.dt)


def energy_above(motion: Motion, frequency: float = CHATTER_FREQUENCY_HZ) -> float:
    """Compute the share of the energy of v above a frequency [Hz], all joints together.

    The straight line of least squares is subtracted from each joint's velocity and a Hann window
    applied, so that neither a drift nor the ends of the run count as chatter. 0 where v varies by
    less than 1e-4 rad/s; NaN for a run of less than 0.2 s or steps of 0.05 s and more, in which
    there are no such frequencies.
    """
    v, dt = motion.trace.applied, motion.trace.dt
    n = len(v)
    if n * dt < MIN_PERIODS / frequency or dt * frequency * 2 >= 1:
        return float("nan")
    varying = _detrended(v)
    if np.abs(varying).max() < NEGLIGIBLE_SPEED_RAD_S:
        return 0.0
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(n) + 0.5) / n)
    spectrum = np.fft.rfft(varying * window[:, None], axis=0)
    energy = np.sum(spectrum.real**2 + spectrum.imag**2, axis=1)
    energy[1 : (n + 1) // 2] *= 2  # all but the mean and half the sampling rate stand for two
    fast = np.arange(len(energy)) > frequency * n * dt
    return float(energy[fast].sum() / energy.sum())


def _detrended(v: Array) -> Array:
    """Subtract the least-squares straight line from each column of v (n, nv)."""
    t = np.arange(len(v)) - (len(v) - 1) / 2
    varying: Array = v - v.mean(axis=0)
    varying -= np.outer(t, (t @ varying) / (t @ t))
    return varying


SMOOTHNESS = (
    Metric(
        "jerk_rms_scaled", "", "low", INF,
        "RMS joint jerk times T^3 / A, duration T, extent A: root of the dimensionless jerk",
        jerk_rms_scaled,
        "[HoganSternad2009]",
    ),
    Metric(
        "acceleration_variation_rad_s2", "rad/s^2", "low", INF,
        "total variation of the joint accelerations, summed over joints",
        acceleration_variation,
    ),
    Metric(
        "reversals_per_s", "1/s", "low", INF,
        "sign changes of dv/dt per second, beyond 0.1 rad/s^2, of the joint with most of them",
        reversals,
    ),
    Metric(
        "energy_above_10_hz_share", "", "low", 1.0,
        "share of the energy of the joint velocities above 10 Hz, less their linear trends",
        energy_above,
    ),
    Metric(
        "sparc", "", "high", -INF,
        "spectral arc length of the joint speed |v|; chatter above 10 Hz does not show in it",
        lambda m: sparc(np.linalg.norm(m.trace.applied, axis=1), m.trace.dt),
        "[Balasubramanian2015]",
    ),
)  # fmt: skip
