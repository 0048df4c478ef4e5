"""Sweeps in a table of trials: families of which one numeric parameter takes several values."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from dikbench.selector import parse_selector

FEWEST = 3
"""Fewer values than this are no sweep."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Trials that differ in one numeric parameter of their scenario, and in the law.

    Attributes:
        number: of the sweep in its report, from 1.
        family: of the scenarios.
        parameter: what is swept.
        others: the other parameters, as in a selector.
        rows: their trials on the ideal plant, time-indexed, first seed, with a column `value`.
    """

    number: int
    family: str
    parameter: str
    others: str
    rows: pd.DataFrame


def sweeps(trials: pd.DataFrame) -> list[Sweep]:
    """Find every sweep with at least three values."""
    first_seed = trials["seed"] == trials["seed"].iloc[0]
    on = first_seed & trials["plant"].eq("ideal") & trials["reference"].eq("time")
    chosen = trials[on]
    groups: dict[tuple[str, str, str], dict[str, float]] = {}
    for scenario in dict.fromkeys(chosen["scenario"]):
        selector = parse_selector(scenario)
        for parameter, text in selector.parameters.items():
            value = _number(text)
            if value is not None:
                others = ",".join(
                    f"{k}={v}" for k, v in selector.parameters.items() if k != parameter
                )
                groups.setdefault((selector.name, parameter, others), {})[scenario] = value
    found = [(key, values) for key, values in groups.items() if len(set(values.values())) >= FEWEST]
    return [
        Sweep(
            number,
            family,
            parameter,
            others,
            chosen[chosen["scenario"].isin(values)].assign(
                value=lambda rows, values=values: rows["scenario"].map(values)
            ),
        )
        for number, ((family, parameter, others), values) in enumerate(found, start=1)
    ]


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
