"""What is searched of a scenario family: the parameters that it draws, robots and seeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.errors import DikbenchError
from dikbench.plugins.drawing import (
    Cell,
    choices_of,
    drawn_parameters,
    drawn_robots,
    is_whole,
    number_at,
)
from dikbench.plugins.finding import Plugin, scenario_plugin
from dikbench.scenario.variation import NO_VARIATION
from dikbench.selector import Selector
from dikbench.study.split import SPLITS

SEEDS: Final = SPLITS["test"][:8]
"""The seeds among which is searched where a seed changes a family's scenarios; formulations are
not tuned on them."""


@dataclass(frozen=True)
class Axis:
    """What is searched along one axis of a box: a parameter, the robot, or the seed.

    Attributes:
        name: of the parameter.
        high: upper bound of the axis, whose lower one is 0: 1 for a number, otherwise the number
            of the last choice.
        whole: whether only whole numbers are places on it.
        text_at: writes the value at a place.
    """

    name: str
    high: float
    whole: bool
    text_at: Callable[[float], str]


@dataclass(frozen=True)
class Searched:
    """A box of scenarios: what the selector of a family leaves open.

    Attributes:
        given: what is fixed.
        plugin: its family.
        axes: what is searched.
    """

    given: Selector
    plugin: Plugin
    axes: tuple[Axis, ...]

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Lower and upper bound of each axis."""
        return [(0.0, axis.high) for axis in self.axes]

    @property
    def whole(self) -> Mask:
        """Which axes have whole numbers only, (d,)."""
        return np.array([axis.whole for axis in self.axes])

    def cell_at(self, point: Array) -> Cell:
        """Return selector and seed of the scenario at a point (d,) of the box."""
        values = dict(self.given.parameters)
        seed = 0
        for axis, place in zip(self.axes, point.tolist(), strict=True):
            if axis.name == "seed":
                seed = int(axis.text_at(place))
            else:
                values[axis.name] = axis.text_at(place)
        return Selector(self.given.name, values).ordered(self.plugin.parameters), seed

    def __str__(self) -> str:
        """Write the ranges that are searched."""
        parts = []
        for axis in self.axes:
            ends = [axis.text_at(0.0), axis.text_at(axis.high)]
            if axis.whole and not ends[0].isdigit():
                every = map(axis.text_at, range(int(axis.high) + 1))
                parts.append(f"{axis.name} {'|'.join(every)}")
            else:
                parts.append(f"{axis.name} {ends[0]} to {ends[1]}")
        return ", ".join(parts)


def searched(given: Selector) -> Searched:
    """Make the box of what a selector leaves open.

    Args:
        given: a family, with the parameters that stay.

    Raises:
        DikbenchError: if there is no such family, or nothing of it is left to search.
    """
    plugin = scenario_plugin(given.name)
    robots = drawn_robots(plugin, given)
    axes = [_among("robot", robots)] if len(robots) > 1 else []
    for name, parameter in drawn_parameters(plugin, given).items():
        if choices := choices_of(parameter):
            axes += [_among(name, choices)] if len(choices) > 1 else []
            continue
        drawn = parameter.drawn
        assert drawn is not None
        if is_whole(parameter) and not drawn.log:
            numbers = range(int(drawn.low), int(drawn.high) + 1)
            axes.append(_among(name, tuple(map(str, numbers))))
        else:
            axes.append(Axis(name, 1.0, False, partial(number_at, parameter)))
    if getattr(plugin.factory, "variation", NO_VARIATION) != NO_VARIATION:
        axes.append(_among("seed", tuple(map(str, SEEDS))))
    if not axes:
        open_ = ", ".join(drawn_parameters(plugin, Selector(given.name))) or "nothing"
        raise DikbenchError(
            f"scenario {given}: nothing is left to search (of {plugin.name} in general: {open_}); "
            "valid: a selector that fixes less"
        )
    return Searched(given, plugin, tuple(axes))


def _among(name: str, choices: tuple[str, ...]) -> Axis:
    """Make the axis of a choice."""
    return Axis(name, float(len(choices) - 1), True, lambda place: choices[round(place)])
