"""Spectral arc length, a smoothness of human movements below 10 Hz."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.arrays import Array

CUTOFF_FREQUENCY_HZ: Final = 10.0
"""Human limbs do not move at higher frequencies; a control loop chatters at 50 to 250 Hz."""

MAGNITUDE_THRESHOLD: Final = 0.05
"""The spectrum ends at the last frequency with this share of the largest magnitude."""

PADDING_DOUBLINGS: Final = 4
"""Zeros are appended up to 2^4 times the next power of two samples."""


def sparc(speed: Array, dt: float) -> float:
    """Compute minus the arc length of the magnitude spectrum of a speed profile (n,), scaled to 1.

        - sum_k sqrt((1 / K)^2 + (M_k+1 - M_k)^2),   M = |FFT(speed)| / max |FFT(speed)|

    over the K intervals from the first to the last frequency up to 10 Hz at which M >= 0.05. It is
    near -1.4 for a single smooth movement, and lower the more often the speed falls and rises. It
    is made for movements from rest to rest below 10 Hz and does not show the chatter of a control
    loop, so it is never used alone. NaN where nothing moves.
    """
    if not speed.any():
        return float("nan")
    padded = 2 ** (int(np.ceil(np.log2(len(speed)))) + PADDING_DOUBLINGS)
    magnitude = np.abs(np.fft.rfft(speed, padded))
    magnitude = magnitude[: int(CUTOFF_FREQUENCY_HZ * padded * dt) + 1]
    magnitude /= magnitude.max()
    visible = np.flatnonzero(magnitude >= MAGNITUDE_THRESHOLD)
    part = magnitude[visible[0] : visible[-1] + 1]
    if len(part) < 2:
        return float("nan")
    return -float(np.hypot(1 / (len(part) - 1), np.diff(part)).sum())
