"""Whether the order of formulations hangs on a parameter that all scenarios have."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd
from scipy.stats import kendalltau

from dikbench.selector import Selector, parse_selector
from dikbench.statistics.success import rates, succeeded

PARAMETERS: Final = ("characteristic_length", "dt", "gain")
"""The parameters of scenarios that are conventions, not difficulties."""

DEFAULT: Final = "default"


def rank_agreement(trials: pd.DataFrame) -> pd.DataFrame:
    """Compare the rates of success at each value of a parameter with those at its default.

    Only scenarios are counted that ran at all of the values, and formulations that ran all of them.

    Args:
        trials: the rows of a setting that count (see `counted`).

    Returns:
        A row per parameter and value, `parameter`, `value`, `scenarios`, `formulations`, and
        `against` the default, or the middle value where it did not run, `kendall` (tau-b of the
        rates, NaN where all are the same) and `largest_change` (of a rate); empty where no
        parameter has two values.
    """
    lines: list[dict[str, Any]] = []
    selectors = {text: parse_selector(text) for text in trials["scenario"].unique()}
    for parameter in PARAMETERS:
        value = trials["scenario"].map(
            {text: each.parameters.get(parameter, DEFAULT) for text, each in selectors.items()}
        )
        bare = trials["scenario"].map(
            {text: str(_without(each, parameter)) for text, each in selectors.items()}
        )
        values = sorted(value.unique(), key=lambda each: -1.0 if each == DEFAULT else float(each))
        everywhere = value.groupby(bare).transform("nunique").eq(len(values))
        if len(values) < 2 or not everywhere.any():
            continue
        rate_at = {
            each: _rates(trials[everywhere & value.eq(each)].assign(scenario=bare))
            for each in values
        }
        common = pd.concat(rate_at, axis=1).dropna()
        against = DEFAULT if DEFAULT in values else values[len(values) // 2]
        first = common[against].to_numpy()
        for each in (value for value in values if value != against):
            there = common[each].to_numpy()
            lines.append(
                {
                    "parameter": parameter,
                    "value": each,
                    "against": against,
                    "scenarios": int(bare[everywhere].nunique()),
                    "formulations": len(common),
                    "kendall": float(kendalltau(first, there).statistic),
                    "largest_change": float(np.abs(there - first).max(initial=0.0)),
                }
            )
    return pd.DataFrame(lines)


def _rates(trials: pd.DataFrame) -> pd.Series:
    """Compute the rate of every formulation and solver that ran every case."""
    found = rates(trials, succeeded(trials))
    index = pd.MultiIndex.from_frame(found.contenders)
    return pd.Series(np.where(found.whole, found.rate, np.nan), index)


def _without(selector: Selector, parameter: str) -> Selector:
    """Return a selector without one of its parameters."""
    left = {name: value for name, value in selector.parameters.items() if name != parameter}
    return Selector(selector.name, left)
