"""Which limits were in force in the runs of a table, as far as their rows tell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final

import pandas as pd

from dikbench.report.sentences.words import listed, several
from dikbench.selector import parse_selector
from dikbench.statistics.failures import ran
from dikbench.statistics.success import with_facts

ACCELERATION: Final = "acceleration_violation_max_rad_s2"
"""The metric of accelerations, which is 0 where no limit is in force."""

_MEASURED: Final[Mapping[str, str]] = MappingProxyType(
    {"distance_violation_max_m": "distances to keep", "torque_usage_max": "limits of torque"}
)
"""Metrics that are defined only where something is in force."""


def with_acceleration_limits(trials: pd.DataFrame) -> set[str]:
    """Find the scenarios in which limits of acceleration are in force beyond doubt.

    Those that were asked to have them, and those in which a run was above one.
    """
    if ACCELERATION not in trials:
        return set()
    rows = ran(trials)
    asked = {
        scenario
        for scenario in rows["scenario"].unique()
        if str(parse_selector(scenario).parameters.get("acceleration", "false")).lower() != "false"
    }
    return asked | set(rows.loc[rows[ACCELERATION].gt(0), "scenario"])


def notes_on_limits(trials: pd.DataFrame) -> Iterator[str]:
    """Say which limits were in force in no run, and how many scenarios with the others count."""
    limited = with_acceleration_limits(trials)
    lacking = [] if limited else ["limits of acceleration"]
    lacking += [
        what for of, what in _MEASURED.items() if of not in trials or trials[of].isna().all()
    ]
    if lacking:
        yield (
            f"No run is known to have {listed(lacking).replace(' and ', ' or ')}: these have no "
            "column here."
        )
    if limited:
        facts = with_facts(ran(trials)).drop_duplicates("scenario")
        count = int(
            (facts["scenario"].isin(limited) & facts["feasible"].isin(["time", "path"])).sum()
        )
        yield (
            f"Limits of acceleration are known to be in force in {len(limited)} of "
            f"{several(len(facts), 'scenario')}, of which {count or 'none'} count"
            f"{'s' if count == 1 else ''} in the table of success; elsewhere the figure is 0."
        )
