"""The situations in which laws are compared: what a scenario's own joint motion asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from dikbench.plugins.built_scenarios import built
from dikbench.scenario.oracle import OracleMotion
from dikbench.scenario.scenario import Scenario

NEAR_LIMIT: Final = 0.05
"""Nearer to a position limit than this [rad] a motion is at the limit."""

NEAR_SINGULARITY: Final = 0.05
"""Below this smallest singular value of the task Jacobian (m, rad) a motion is near a singularity:
arms of this size have 0.08 to 0.3 in ordinary postures."""


@dataclass(frozen=True)
class Situation:
    """A kind of difficulty.

    Attributes:
        name: what it is called.
        definition: what makes a scenario one of it, in a clause.
        holds: whether a scenario is one of it, by its joint motion.
    """

    name: str
    definition: str
    holds: Callable[[Scenario], bool]


def _motion(holds: Callable[[OracleMotion], bool]) -> Callable[[Scenario], bool]:
    """Whether a scenario has a joint motion of which this holds."""
    return lambda scenario: scenario.motion is not None and holds(scenario.motion)


UNREACHABLE: Final = Situation(
    "Jumping or unreachable targets",
    "no joint motion follows the target",
    lambda scenario: scenario.motion is None,
)
CONSTRAINED: Final = Situation(
    "Obstacles and torque limits",
    "distances from obstacles, between links, or torques are limited",
    lambda scenario: bool(scenario.constraints),
)
OUTSIDE: Final = Situation(
    "Started outside a joint limit",
    "the start lies outside a position limit",
    _motion(lambda motion: motion.margin[0] < 0),
)
AT_LIMITS: Final = Situation(
    "At joint limits",
    f"the path leads to within {NEAR_LIMIT:g} rad of a position limit, or beyond it",
    _motion(lambda motion: motion.margin.min() < NEAR_LIMIT),
)
SINGULAR: Final = Situation(
    "Near singularities",
    f"the smallest singular value falls below {NEAR_SINGULARITY:g} (m, rad) on the path",
    _motion(lambda motion: motion.sigma_min.min() < NEAR_SINGULARITY),
)
TOO_FAST: Final = Situation(
    "Beyond joint speed",
    "the path asks for joint speeds above their limits, away from limits and singularities",
    _motion(lambda motion: motion.peak_speed_ratio > 1),
)
FREE: Final = Situation("Free space", "nothing is in the way of the path", lambda scenario: True)
UNKNOWN: Final = Situation(
    "Scenarios that cannot be built here", "their difficulty is not known", lambda scenario: False
)

IN_ORDER: Final = (CONSTRAINED, UNREACHABLE, OUTSIDE, AT_LIMITS, SINGULAR, TOO_FAST, FREE)
"""As they are looked at: a scenario belongs to the first that holds."""

READING_ORDER: Final = (
    SINGULAR,
    AT_LIMITS,
    TOO_FAST,
    FREE,
    CONSTRAINED,
    OUTSIDE,
    UNREACHABLE,
    UNKNOWN,
)
"""As they are told."""


def situation_of(scenario: str, seed: int) -> Situation:
    """The situation of a scenario, by the joint motion from which it was built."""
    found = built(scenario, seed)
    if isinstance(found, str):
        return UNKNOWN
    return next(kind for kind in IN_ORDER if kind.holds(found))
