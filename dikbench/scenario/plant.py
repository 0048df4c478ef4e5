"""Plants: what a robot makes of a commanded velocity, and what a law gets to see of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.limits import Limits

Drive = Callable[[Array, Limits, float], Array]
"""(commanded v (nv,), limits at q, dt [s]) -> applied v (nv,)."""

LONGEST_DELAY: Final = 1000
"""Control steps; beyond that there is no loop to close."""


def ideal(v: Array, limits: Limits, dt: float) -> Array:
    """Integrates whatever is commanded, limits or not: shows violations."""
    return v


def saturating(v: Array, limits: Limits, dt: float) -> Array:
    """A drive that clips each joint to its velocity and position limits: shows going off course."""
    velocity = limits.joint.velocity
    if velocity is not None:
        v = np.clip(v, velocity.lower, velocity.upper)
    if limits.to_lower is not None and limits.to_upper is not None:
        # A joint that is outside already may not go further out, and is not thrown back.
        v = np.clip(v, -np.maximum(limits.to_lower, 0) / dt, np.maximum(limits.to_upper, 0) / dt)
    return v


DRIVES: Final[Mapping[str, Drive]] = MappingProxyType({"ideal": ideal, "saturating": saturating})


@dataclass(frozen=True)
class Plant:
    """A drive behind a measurement and a line of communication.

    Attributes:
        drive: what becomes of a command that arrives.
        noise: standard deviation of the configuration that the law sees about the true one, per
            joint and step [rad or m]; white and normal, drawn from the trial's seed.
        delay: control steps by which a command arrives late; until the first one does, the robot
            keeps the velocity that it has at the start.
    """

    drive: Drive = ideal
    noise: float = 0.0
    delay: int = 0

    def __post_init__(self) -> None:
        """Check the parameters."""
        if not 0 <= self.noise < np.inf:
            raise DikbenchError(f"plant: noise={self.noise} must be finite and at least 0 [rad]")
        if not 0 <= self.delay <= LONGEST_DELAY:
            raise DikbenchError(f"plant: delay={self.delay} must be 0 to {LONGEST_DELAY} steps")


REFERENCE_MODES: Final = MappingProxyType(
    {
        "time": "the reference moves on with the clock",
        "path": "the reference moves on with the progress that was achieved",
    }
)
