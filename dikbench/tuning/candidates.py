"""What is tried for a formulation: points of a scrambled Sobol sequence over its ranges."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, log, log2
from typing import Final

import numpy as np
from scipy.stats import qmc

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.parameters import Drawn
from dikbench.plugins.building import in_declared_order, make_formulation
from dikbench.plugins.drawing import DIGITS, is_whole, scaled
from dikbench.plugins.finding import formulation_plugin, plugins
from dikbench.plugins.tuned import ranges_of
from dikbench.selector import Selector

MOST_POINTS_PER_CANDIDATE: Final = 4
"""Points that a formulation refuses are passed over, up to so many for each that is wanted."""

EDGE: Final = 0.03
"""A tuned value within this share of its range from an end is at the edge of it."""


def tunable() -> list[Selector]:
    """List the registered formulations with a parameter to tune."""
    return [chosen for name in plugins("formulation") if ranges_of(chosen := Selector(name))]


def candidates(selector: Selector, budget: int, seed: int) -> list[Selector]:
    """Make the formulations that are tried, in the order of the sequence, without the default.

    The first half of a budget is the whole of half a budget. Of a sequence in d dimensions each
    point u gives low + u (high - low) for every parameter, or the same of the logarithms.

    Args:
        selector: the formulation, with the parameters that stay.
        budget: number of candidates; a power of 2 covers the ranges most evenly.
        seed: of the scrambling.

    Raises:
        DikbenchError: if the formulation has nothing to tune, or refuses most of the points.
    """
    ranges = ranges_of(selector)
    if not ranges:
        raise DikbenchError(
            f"formulation {str(selector)!r} has no parameter to tune; valid: "
            f"{', '.join(map(str, tunable()))}, or a class with Drawn(low, high) in an annotation"
        )
    sequence = qmc.Sobol(len(ranges), scramble=True, rng=np.random.default_rng(seed))
    points = sequence.random_base2(ceil(log2(MOST_POINTS_PER_CANDIDATE * budget)))
    found: dict[Selector, None] = {}
    refused = ""
    for point in points:
        try:
            found[_at(selector, ranges, point)] = None
        except DikbenchError as error:
            refused = f": {error}"
        if len(found) == budget:
            return list(found)
    if found and not refused:  # whole numbers: all of them
        return list(found)
    raise DikbenchError(
        f"formulation {str(selector)!r} accepts {len(found)} of {len(points)} points of its "
        f"ranges, fewer than the budget {budget}{refused}"
    )


def _at(selector: Selector, ranges: Mapping[str, Drawn], point: Array) -> Selector:
    """Return the formulation at a point of the unit cube (d,).

    Raises:
        DikbenchError: if the formulation refuses it.
    """
    parameters = formulation_plugin(selector.name).parameters
    values = {}
    for (name, drawn), u in zip(ranges.items(), point, strict=True):
        value = scaled(drawn, float(u))
        values[name] = str(round(value)) if is_whole(parameters[name]) else f"{value:.{DIGITS}g}"
    made = in_declared_order(
        "formulation", Selector(selector.name, {**selector.parameters, **values})
    )
    make_formulation(made)
    return made


def share(drawn: Drawn, value: float) -> float:
    """Return where a number lies in a range, 0 to 1 inside; the inverse of `scaled`."""
    if drawn.log:
        return log(value / drawn.low) / log(drawn.high / drawn.low)
    return (value - drawn.low) / (drawn.high - drawn.low)


def at_edge(selector: Selector, found: Selector) -> list[str]:
    """Name the parameters whose value is at an end of its range: a wider one may be better.

    Args:
        selector: the formulation that was tuned.
        found: the same at the values that were found.
    """
    values = {
        name: share(drawn, float(found.parameters[name]))
        for name, drawn in ranges_of(selector).items()
        if name in found.parameters
    }
    return [name for name, where in values.items() if min(where, 1 - where) < EDGE]
