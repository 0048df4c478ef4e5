"""Random instances of a scenario family: its parameters drawn in the ranges that they declare.

An instance is a selector, which fixes what its author wants fixed, and a number. Each parameter is
drawn from a stream of its own, so that one that is added to a family, or fixed, moves no other.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, log
from typing import Final, get_args

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn, Parameter
from dikbench.plugins.finding import Plugin, scenario_plugin
from dikbench.plugins.source import digest
from dikbench.scenario.family import certified_robots
from dikbench.selector import Selector

DIGITS: Final = 4
"""Significant digits of a number that is drawn, so that its text is exact."""

SEEDS_APART: Final = 1000
"""Attempt a at instance n has the seed n + 1000 a: no two instances share one, and a seed shows its
number."""

Cell = tuple[Selector, int]
"""Selector and seed of a scenario."""


def drawn_cell(given: Selector, number: int, attempt: int = 0) -> Cell:
    """Draw a scenario: the selector and the seed of an attempt at an instance.

    Every parameter with `Drawn` that is not given is drawn, uniformly or its logarithm is. Where
    the robot is not given, the robots of the family take turns by number.

    Args:
        given: what is fixed.
        number: of the instance.
        attempt: how many drawn before it were rejected.

    Raises:
        DikbenchError: if there is no such family, or nothing of it is left to draw.
    """
    plugin = scenario_plugin(given.name)
    values = dict(given.parameters)
    robots = drawn_robots(plugin, given)
    free = drawn_parameters(plugin, given)
    if len(robots) <= 1 and not free:
        what = ", ".join(drawn_parameters(plugin, Selector(given.name))) or "nothing"
        raise DikbenchError(
            f"scenario {given}: no instance can be drawn, for it leaves nothing to draw (of "
            f"{plugin.name} in general: {what}); valid: seeds in place of instances"
        )
    if robots:
        values["robot"] = robots[number % len(robots)]
    for name, parameter in free.items():
        stream = int(digest(f"{plugin.name} {name}"), 16)
        values[name] = _drawn(parameter, np.random.default_rng([stream, number, attempt]))
    return Selector(given.name, values).ordered(plugin.parameters), number + SEEDS_APART * attempt


def drawn_parameters(plugin: Plugin, given: Selector) -> Mapping[str, Parameter]:
    """Return the parameters of a family that are drawn, by name: those that are not given."""
    return {
        name: parameter
        for name, parameter in plugin.parameters.items()
        if parameter.drawn is not None and name not in given.parameters
    }


def drawn_robots(plugin: Plugin, given: Selector) -> tuple[str, ...]:
    """Return the robots that take turns; none where the robot is given, or has no choice."""
    return () if "robot" in given.parameters else certified_robots(plugin.factory)


def is_whole(parameter: Parameter) -> bool:
    """Say whether a parameter is a whole number, or none."""
    return parameter.numeric and float not in (parameter.type, *get_args(parameter.type))


def scaled(drawn: Drawn, share: float) -> float:
    """Return the number at a share of a range, 0 to 1, of its logarithms where `log` is set."""
    low, high = drawn.low, drawn.high
    if drawn.log:
        return exp(log(low) + share * (log(high) - log(low)))
    return low + share * (high - low)


def _drawn(parameter: Parameter, random: np.random.Generator) -> str:
    """Draw the value of a parameter, as a text that is exact."""
    bounds = parameter.drawn
    assert bounds is not None
    if choices := choices_of(parameter):
        return choices[int(random.integers(len(choices)))]
    low, high = bounds.low, bounds.high
    if is_whole(parameter) and not bounds.log:
        return str(int(random.integers(int(low), int(high), endpoint=True)))
    return number_at(parameter, random.uniform())


def number_at(parameter: Parameter, share: float) -> str:
    """Write the number at a share of the range of a numeric parameter, 0 to 1, as an exact text."""
    bounds = parameter.drawn
    assert bounds is not None
    value = scaled(bounds, share)
    rounded = round(value) if is_whole(parameter) else float(f"{value:.{DIGITS}g}")
    return repr(min(max(rounded, bounds.low), bounds.high))


def choices_of(parameter: Parameter) -> tuple[str, ...]:
    """Return the values between which a parameter that is no number is drawn, as texts."""
    if parameter.type is bool:
        return ("false", "true")
    return tuple(map(str, parameter.choices))
