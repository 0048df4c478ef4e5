"""The number of control steps of a duration."""

from __future__ import annotations

from typing import Final

from dikbench.errors import DikbenchError

MOST_STEPS: Final = 100_000
"""Largest number of control steps of a run."""


def steps_in(duration: float, dt: float) -> int:
    """Compute the number of control steps of dt [s] in a duration [s], at least one.

    Raises:
        DikbenchError: if there are more than `MOST_STEPS`, or less than half a step.
    """
    if not 0.5 <= duration / dt <= MOST_STEPS:
        raise DikbenchError(
            f"a run of {duration:.4g} s at dt = {dt:.4g} s has {duration / dt:.3g} steps; "
            f"valid: 1 to {MOST_STEPS}"
        )
    return max(1, round(duration / dt))
