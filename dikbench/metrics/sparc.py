"""Spectral arc length, the smoothness of human movements; blind to what is fast."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

FASTEST: Final = 10.0
"""Its cut-off [Hz]: a human limb does nothing beyond, a control loop chatters at 50 to 250 Hz."""

VISIBLE: Final = 0.05
"""Beyond the last frequency with this share of the largest magnitude the spectrum is over."""

PADDING: Final = 4
"""Zeros make the signal 2^4 times as long as the next power of two."""


def sparc(speed: Array, dt: float) -> float:
    """Minus the length of the magnitude spectrum of a speed profile (n,), both axes scaled to 1.

        - sum_k sqrt((1 / K)^2 + (M_k+1 - M_k)^2),   M = |FFT(speed)| / max |FFT(speed)|

    over the K intervals from the first to the last frequency up to 10 Hz at which M >= 0.05. Near
    -1.4 for a single smooth movement, the lower the more often the speed sinks and rises. Made for
    movements from rest to rest below 10 Hz: chatter of a control loop is invisible to it, so it
    never stands alone. NaN where nothing moves.
    """
    if not speed.any():
        return float("nan")
    padded = 2 ** (int(np.ceil(np.log2(len(speed)))) + PADDING)
    magnitude = np.abs(np.fft.rfft(speed, padded))
    magnitude = magnitude[: int(FASTEST * padded * dt) + 1]
    magnitude /= magnitude.max()
    visible = np.flatnonzero(magnitude >= VISIBLE)
    part = magnitude[visible[0] : visible[-1] + 1]
    if len(part) < 2:
        return float("nan")
    return -float(np.hypot(1 / (len(part) - 1), np.diff(part)).sum())
