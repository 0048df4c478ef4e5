"""Write `teleoperation.csv` beside this file: poses as a hand in teleoperation would send them.

Made up, not recorded: reaches of least jerk between random places in front of a Panda, a tremor of
9 Hz, a sender of 30 Hz whose stamps jitter, packets that wait and come in bursts, and gaps in which
the hand moves on. Times are seconds since 1970, as a recorder's clock gives them.

    python scenarios/streams/make_teleoperation.py
"""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import Final

import numpy as np
import pinocchio as pin

FILE: Final = Path(__file__).with_name("teleoperation.csv")

SEED: Final = 7

RATE_HZ: Final = 30.0

REACHES: Final = 7

CENTRE: Final = np.array([0.40, 0.0, 0.45])
"""[m], in front of the Panda's base; its hand points down."""

TREMOR_M: Final = 3e-4

GAPS: Final = ((2.1, 0.28), (5.3, 0.45))
"""Beginning and length of the gaps [s]."""

SHORTEST_S: Final = 2e-4
"""Packets of a burst are so far apart."""

CLOCK: Final = Decimal("1700000000")


def lines() -> list[str]:
    """Return the lines of the file."""
    random = np.random.default_rng(SEED)
    places = CENTRE + random.uniform(-1, 1, (REACHES + 1, 3)) * (0.10, 0.15, 0.08)
    turns = random.uniform(-0.35, 0.35, (REACHES + 1, 3))
    times = np.cumsum([0.0, *random.uniform(1.0, 1.5, REACHES)])
    phases = random.uniform(0, 2 * np.pi, 3)
    sent = np.arange(0.0, times[-1], 1 / RATE_HZ)
    sent = sent[[not any(start < t < start + long for start, long in GAPS) for t in sent]]
    stamps = sent + random.gamma(1.0, 0.002, len(sent))
    late = random.uniform(size=len(sent)) < 0.05
    stamps[late] += random.uniform(0.02, 0.06, late.sum())
    apart = SHORTEST_S * np.arange(len(sent))
    stamps = np.maximum.accumulate(stamps - apart) + apart  # who waits holds up who comes after
    found = ["# made up, not recorded: see make_teleoperation.py", "t,x,y,z,qx,qy,qz,qw"]
    down = np.diag([1.0, -1.0, -1.0])
    for t, stamp in zip(sent.tolist(), stamps.tolist(), strict=True):
        k = min(int(np.searchsorted(times, t, side="right")) - 1, REACHES - 1)
        u = (t - times[k]) / (times[k + 1] - times[k])
        s = u**3 * (10 - 15 * u + 6 * u**2)
        p = places[k] + s * (places[k + 1] - places[k])
        p = p + TREMOR_M * np.sin(2 * np.pi * 9.0 * t + phases)
        R = down @ pin.exp3(turns[k] + s * (turns[k + 1] - turns[k]))
        numbers = [*p, *pin.Quaternion(R).coeffs()]
        clock = CLOCK + Decimal(f"{stamp:.6f}")
        found.append(",".join([str(clock), *(f"{number:.6f}" for number in numbers)]))
    return found


if __name__ == "__main__":
    FILE.write_text("\n".join(lines()) + "\n", encoding="utf-8")
