"""The rows of which success is spoken: settings, situations, and the plant that is judged."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final, get_args

import pandas as pd

from dikbench.scenario.situation import Situation
from dikbench.statistics.success import Setting, counted, with_facts

SETTINGS: Final[tuple[Setting, ...]] = get_args(Setting)

IN_WORDS: Final[Mapping[Setting, str]] = MappingProxyType(
    {"path": "the path may wait", "time": "the clock does not wait"}
)
"""The settings in words."""

CONSTRAINED: Final[Situation] = "obstacles or torques"
"""The situation that some formulations are not told of."""

DEFINITIONS: Final[Mapping[Situation, str]] = MappingProxyType(
    {
        "near singularities": "the exact motion passes a smallest singular value below 0.05 "
        "(m, rad), or a singular placement within 0.05 (m, rad), and needs more than 1.2 of a "
        "joint's speed limit",
        "at joint limits": "the exact motion comes within 50 mrad of a position limit, or beyond",
        "beyond joint speed": "the exact motion needs more than a joint's speed limit, and is in "
        "none of the situations above",
        "free space": "the exact motion keeps every limit, and is in none of the situations above "
        "(it may pass a singularity at a speed that asks for little)",
        "steps": "the target jumps, so that no motion can stay at it",
        "start outside": "the start is outside a position limit",
        CONSTRAINED: "distances from obstacles, between links, or torques are limited",
    }
)
"""The situations in the order in which they are told, and what holds in each."""


def judged_plant(trials: pd.DataFrame) -> str:
    """Return the plant whose trials are judged: the ideal one, on which violations show, if run."""
    plants = list(trials["plant"].unique())
    return "ideal" if "ideal" in plants or not plants else str(plants[0])


def judged_rows(trials: pd.DataFrame, setting: Setting) -> pd.DataFrame:
    """Return the rows that count in a setting, of the plant that is judged."""
    facts = with_facts(trials)
    return counted(facts[facts["plant"].eq(judged_plant(facts))], setting)


def rows_of_all(of_setting: Mapping[Setting, pd.DataFrame]) -> pd.DataFrame:
    """Return the rows that count in any setting, each once (targets at rest count in both)."""
    every = pd.concat(of_setting.values())
    found: pd.DataFrame = every[~every.index.duplicated()]
    return found
