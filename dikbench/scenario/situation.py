"""The situation of a scenario: what is difficult about it, in a word."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

from dikbench.problem.constraints import Constraint
from dikbench.scenario.oracle import OracleMotion

Situation = Literal[
    "obstacles or torques",
    "start outside",
    "steps",
    "at joint limits",
    "near singularities",
    "beyond joint speed",
    "free space",
]
"""The situations, in the order in which they are asked for; the first one counts."""

NEAR_LIMIT_RAD: Final = 0.05
"""A motion whose margin to a position limit falls below this [rad or m] is at the limit."""

NEAR_SINGULARITY: Final = 0.05
"""A motion is near a singularity where its smallest singular value (m, rad) is below this ..."""

SINGULAR_NEED: Final = 1.2
"""... and where it needs more than this share of a joint's speed limit."""


def situation_of(
    motion: OracleMotion | None,
    constraints: Sequence[Constraint],
    start_margin: float,
    *,
    moving: bool,
) -> Situation:
    """Name the situation of a scenario.

    Args:
        motion: its exact joint motion; None where there is none.
        constraints: conditions in addition to the joint limits.
        start_margin: distance of the start to a position limit [rad or m], negative outside.
        moving: whether its reference moves; else it is a step, or several.
    """
    if constraints:
        return "obstacles or torques"
    if start_margin < 0:
        return "start outside"
    if not moving:
        return "steps"
    if motion is None:
        return "free space"
    if motion.margin.min() < NEAR_LIMIT_RAD:
        return "at joint limits"
    need = motion.peak_speed_ratio
    if motion.sigma_min.min() < NEAR_SINGULARITY and need > SINGULAR_NEED:
        return "near singularities"
    return "beyond joint speed" if need > 1 else "free space"
