"""Sweeps in a table of trials: scenarios of which one numeric parameter takes several values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from dikbench.report.selection.rows import one_way
from dikbench.results.selected import parameters_of
from dikbench.selector import listed

FEWEST = 3
"""Fewer values than this are no sweep."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Trials that differ in one numeric parameter of their scenario, in the law, in a second one.

    Attributes:
        family: of the scenarios.
        parameter: what is swept.
        second: the parameter that distinguishes several sweeps; empty where there is one.
        others: the other parameters, as in a selector.
        rows: their trials, with columns `value` and `second`, a text.
    """

    family: str
    parameter: str
    second: str
    others: str
    rows: pd.DataFrame


Place = tuple[float, str]
"""The value of the swept parameter, and that of the second one."""


def sweeps(trials: pd.DataFrame) -> list[Sweep]:
    """Find every sweep with at least three values; what crosses another one is shown once."""
    chosen = one_way(trials)
    parameters = parameters_of(chosen, "scenario")
    family_of = dict(zip(chosen["scenario"], chosen["scenario_family"], strict=True))
    families: dict[str, dict[str, Mapping[str, Any]]] = {}
    for name, family in family_of.items():
        families.setdefault(family, {})[name] = parameters[name]
    found: list[Sweep] = []
    for family, members in families.items():
        shown: set[str] = set()
        for parameter, second, others, places in _longest_first(members):
            if places.keys() <= shown:
                continue
            shown |= places.keys()
            rows = chosen[chosen["scenario"].isin(places)]
            values = [places[scenario] for scenario in rows["scenario"]]
            rows = rows.assign(value=[v for v, _ in values], second=[s for _, s in values])
            found.append(Sweep(family, parameter, second, others, rows))
    return found


def _longest_first(
    members: Mapping[str, Mapping[str, Any]],
) -> list[tuple[str, str, str, dict[str, Place]]]:
    """The sweeps in the scenarios of a family, those over more scenarios and values first."""
    keys = list(dict.fromkeys(key for parameters in members.values() for key in parameters))
    found = [
        (parameter, second, others, places)
        for parameter in keys
        for second in ("", *(key for key in keys if key != parameter))
        for others, places in _groups(members, parameter, second).items()
        if _is_sweep(places, second)
    ]
    return sorted(
        found, key=lambda sweep: (-len(sweep[3]), -len({v for v, _ in sweep[3].values()}))
    )


def _groups(
    members: Mapping[str, Mapping[str, Any]], parameter: str, second: str
) -> dict[str, dict[str, Place]]:
    """Scenarios that share all parameters but one or two, with the values of these."""
    groups: dict[str, dict[str, Place]] = {}
    for name, parameters in members.items():
        value = number(parameters.get(parameter))
        other = parameters.get(second) if second else ""
        if value is not None and other is not None:
            rest = {k: v for k, v in parameters.items() if k not in {parameter, second}}
            groups.setdefault(listed(rest), {})[name] = (value, str(other))
    return groups


def _is_sweep(places: Mapping[str, Place], second: str) -> bool:
    """Whether each of the sweeps has enough values, and there are several where it says so."""
    values: dict[str, set[float]] = {}
    for value, other in places.values():
        values.setdefault(other, set()).add(value)
    return min(map(len, values.values())) >= FEWEST and (len(values) > 1 or not second)


def number(value: Any) -> float | None:
    """Return the finite number that a parameter is, if it is one."""
    try:
        found = float(value)
    except (TypeError, ValueError):
        return None
    return found if abs(found) < float("inf") else None
