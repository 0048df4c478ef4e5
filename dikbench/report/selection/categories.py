"""What became of trials, in few words and colours: the categories of figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import pandas as pd

from dikbench.metrics import Outcome


@dataclass(frozen=True)
class Category:
    """Outcomes that are drawn alike.

    Attributes:
        name: in legends.
        outcomes: which.
        colour: told apart by the colour-blind, and in grey.
        mark: what is written where a cell is too small for its name.
    """

    name: str
    outcomes: frozenset[Outcome]
    colour: str
    mark: str


CATEGORIES: Final = (
    Category("success", frozenset({Outcome.SUCCESS, Outcome.RECOVERED}), "#cfe8cf", ""),
    Category("chattering", frozenset({Outcome.CHATTERING}), "#F0E442", "~"),
    Category("late or unfinished", frozenset({Outcome.LATE, Outcome.UNFINISHED}), "#56B4E9", "s"),
    Category(
        "left the path", frozenset({Outcome.LEFT_PATH, Outcome.NOT_RECOVERED}), "#E69F00", "o"
    ),
    Category("limit broken", frozenset({Outcome.LIMIT_BROKEN}), "#D55E00", "v"),
    Category("collided", frozenset({Outcome.COLLIDED}), "#8C2D04", "c"),
    Category("does not see them", frozenset({Outcome.DOES_NOT_SEE}), "#BBBBBB", "-"),
    Category(
        "broke off", frozenset({Outcome.DIVERGED, Outcome.DID_NOT_RUN}), "#222222", "x"
    ),
)  # fmt: skip
"""From the best to the worst; every outcome is of one."""

_PLACES: Final[Mapping[str, int]] = MappingProxyType(
    {
        outcome.value: place
        for place, category in enumerate(CATEGORIES)
        for outcome in category.outcomes
    }
)


def categories(rows: pd.DataFrame) -> pd.Series:
    """Return the place of each trial's outcome in `CATEGORIES`; NaN where there is none."""
    found: pd.Series = rows["outcome"].map(_PLACES).astype(float)
    return found
