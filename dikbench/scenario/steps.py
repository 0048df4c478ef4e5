"""How many control steps a duration has."""

from __future__ import annotations

from typing import Final

from dikbench.errors import DikbenchError

MOST_STEPS: Final = 100_000
"""A run that is longer would not end in anybody's patience."""


def steps_in(duration: float, dt: float) -> int:
    """Compute the number of control steps of dt [s] in a duration [s], at least one.

    Raises:
        DikbenchError: if there are too many, or the duration is shorter than half a step.
    """
    if not 0.5 <= duration / dt <= MOST_STEPS:
        raise DikbenchError(
            f"a run of {duration:.4g} s at dt = {dt:.4g} s has {duration / dt:.3g} steps; "
            f"valid: 1 to {MOST_STEPS}"
        )
    return max(1, round(duration / dt))
