"""Plants: what a robot makes of a commanded velocity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from dikbench.array import Array
from dikbench.limits import Limits

Plant = Callable[[Array, Limits, float], Array]
"""(commanded v (nv,), limits at q, dt [s]) -> applied v (nv,)."""


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


PLANTS: Final[Mapping[str, Plant]] = MappingProxyType({"ideal": ideal, "saturating": saturating})
REFERENCE_MODES: Final = MappingProxyType(
    {
        "time": "the reference moves on with the clock",
        "path": "the reference moves on with the progress that was achieved",
    }
)
