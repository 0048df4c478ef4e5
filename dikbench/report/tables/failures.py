"""The table of failures: when each trial failed first, and by which figure against its limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite, isnan
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.metrics import Judgement, Outcome
from dikbench.metrics.judging import CHATTER_SHARE
from dikbench.report.drawing.style import contender_name
from dikbench.report.selection.judged import SETTINGS, judged_plant, judged_rows, rows_of_all
from dikbench.report.tables.success import NO_OUTCOMES
from dikbench.report.tables.table import shown
from dikbench.scenario.violation import (
    ACCELERATION_TOLERANCE,
    COLLISION_TOLERANCE_M,
    POSITION_TOLERANCE,
    SPEED_TOLERANCE,
    TORQUE_TOLERANCE,
)
from dikbench.statistics.failures import ran
from dikbench.statistics.success import succeeded, with_facts
from dikbench.statistics.trial_matrix import CONTENDER

CASES_OF_EACH: Final = 3
"""At most so many cases of each formulation with its solver are shown, ..."""

CASES: Final = 40
"""... and so many in all, unless more formulations failed: each is shown with its worst case."""

ID_DIGITS: Final = 8
"""So much of a trial's id is shown, which is enough for `dikbench replay`."""

LONGEST_MESSAGE: Final = 90
"""Characters of a message in a cell."""

DEGREES: Final = float(np.rad2deg(1.0))

_SEVERITY: Final = {outcome.value: place for place, outcome in enumerate(Outcome)}

_CASE: Final = [*CONTENDER, "scenario", "outcome"]


@dataclass(frozen=True)
class Quantity:
    """A quantity that decided an outcome.

    Attributes:
        name: what it is, in words.
        unit: in which it is told; of position limits it is the one of a joint that turns.
        per_unit: how many of these units one of the stored figure is.
        most: the largest stored figure that is no failure; None where it depends on the trial.
        peak: the metric that holds the largest figure of the run; empty where the figure is it.
    """

    name: str
    unit: str = ""
    per_unit: float = 1.0
    most: float | None = None
    peak: str = ""


_UNTIL_DONE: Final = "tolerance [m] at which {}% of the path are done"
_AT_THE_END: Final = "distance [m] from the target at the end"

QUANTITIES: Final[Mapping[str, Quantity]] = MappingProxyType(
    {
        "joint speed over its limit": Quantity(
            "joint speed over its limit", most=SPEED_TOLERANCE, peak="velocity_peak_ratio"
        ),
        "joint acceleration over its limit": Quantity(
            "joint acceleration over its limit", most=ACCELERATION_TOLERANCE
        ),
        "joint torque over its limit": Quantity(
            "joint torque over its limit", most=TORQUE_TOLERANCE, peak="torque_usage_max"
        ),
        "distance [rad or m] of a joint outside its range": Quantity(
            "joint outside its range", "deg", DEGREES, POSITION_TOLERANCE,
            "position_violation_max_rad",
        ),
        "distance [m] below its margin": Quantity(
            "distance below its margin", "mm", 1e3, COLLISION_TOLERANCE_M,
            "distance_violation_max_m",
        ),
        "position": Quantity("off the path, by position", "mm", 1e3),
        "orientation": Quantity("off the path, by orientation (1 rad is 200 mm)", "mm", 1e3),
        _AT_THE_END: Quantity("off the target at the end", "mm", 1e3),
        _UNTIL_DONE.format(99): Quantity("tolerance at which 99 % is done", "mm", 1e3),
        _UNTIL_DONE.format(90): Quantity("tolerance at which 90 % is done", "mm", 1e3),
        "tolerance [m] at which it is in time": Quantity(
            "tolerance at which it is in time", "mm", 1e3
        ),
        "share of the steps that chatter": Quantity("steps that chatter", "%", 1e2, CHATTER_SHARE),
    }
)  # fmt: skip
"""What `outcome_figure` may be of, by `outcome_reason`."""


@dataclass(frozen=True, eq=False)
class Failures:
    """The worst failures of a run.

    Attributes:
        cases: a row per formulation, solver, scenario and outcome, each with the worst trial.
        note: a sentence on what they are and how many more there are.
    """

    cases: pd.DataFrame
    note: str


def failures(trials: pd.DataFrame) -> Failures:
    """List the failed trials, worst first: by outcome, then by the figure over its limit.

    Those of the table of outcomes, and all that did not run, come before the trials that do not
    count, of scenarios that no known motion can do.

    Args:
        trials: the rows of trials.csv.
    """
    counted = rows_of_all({setting: judged_rows(trials, setting) for setting in SETTINGS})
    rows = ran(with_facts(trials))
    rows = rows[rows["plant"].eq(judged_plant(trials)) & rows["outcome"].isin(list(_SEVERITY))]
    broke_off = rows["outcome"].eq(Outcome.DID_NOT_RUN.value)
    rows = rows.assign(counts=rows.index.isin(counted.index) | broke_off)
    if not len(rows):
        return Failures(pd.DataFrame(), NO_OUTCOMES)
    failed = rows[~succeeded(rows)]
    records: list[Any] = failed.to_dict("records")
    order = pd.DataFrame(
        {
            "uncounted": ~failed["counts"].to_numpy(),
            "severity": failed["outcome"].map(_SEVERITY).to_numpy(),
            "ratio": [-_ratio(row) for row in records],
        }
    ).sort_values(["uncounted", "severity", "ratio"], kind="stable")
    worst_first = failed.iloc[order.index]
    number = worst_first.groupby(_CASE, sort=False)["id"].transform("size")
    cases = worst_first.assign(number=number).drop_duplicates(_CASE)
    told = _of_every_formulation(cases)
    told_rows: list[Any] = told.to_dict("records")
    return Failures(
        pd.DataFrame([_told(row) for row in told_rows]),
        _note(rows["counts"], failed["counts"], len(cases), len(told)),
    )


def _of_every_formulation(cases: pd.DataFrame) -> pd.DataFrame:
    """Choose the cases that are shown, formulations in turn: the worst of each, then the next one.

    Who fails worst in many cases, as a law that ignores limits does, leaves room for the others.

    Args:
        cases: worst first.
    """
    few = cases[cases.groupby(CONTENDER, sort=False).cumcount() < CASES_OF_EACH]
    turn = few.groupby("formulation", sort=False).cumcount()
    most = max(CASES, few["formulation"].nunique())
    chosen = turn.sort_values(kind="stable").index[:most]
    found: pd.DataFrame = few[few.index.isin(chosen)]
    return found


def _note(rows: pd.Series, failed: pd.Series, cases: int, told: int) -> str:
    """Say how many trials failed, by whether they count, and what is shown of them."""
    text = f"{int(failed.sum()) or 'None'} of {int(rows.sum())} trials that count failed"
    if others := int((~failed).sum()):
        text += (
            f", and {others} of {int((~rows).sum())} of scenarios of which no motion is known that "
            "keeps all limits, which do not count"
        )
    if not cases:
        return f"{text}."
    text += (
        ". Worst first: each case is the worst trial of a formulation, scenario and outcome, at "
        "the step that decided"
    )
    if told < cases:
        text += (
            f", at most {CASES_OF_EACH} of a formulation with its solver, and one at least of each "
            f"formulation that failed; {cases - told} more "
            f"case{'s are' if cases - told > 1 else ' is'} left out here"
        )
    return (
        f"{text}. Every trial stands in `trials.csv` (`outcome_step`, `outcome_figure`, "
        "`outcome_reason`); `dikbench replay` shows the one of an id."
    )


def _most(row: Mapping[str, Any]) -> float:
    """Return the largest figure that would have been no failure of a trial."""
    reason = row["outcome_reason"]
    quantity = QUANTITIES.get(reason)
    if quantity is not None and quantity.most is not None:
        return quantity.most
    if row["outcome"] == Outcome.NOT_RECOVERED.value and reason != _AT_THE_END:
        return Judgement.of_row(row).recovery_bound(row["tolerance_m"])
    return float(row["tolerance_m"])


def _peak(row: Mapping[str, Any]) -> float:
    """Return the largest figure of a trial's run; NaN where it is not known."""
    figure, quantity = float(row["outcome_figure"]), QUANTITIES.get(row["outcome_reason"])
    # A joint that starts outside is farthest outside there, which is not its fault.
    outside = row["situation"] == "start outside"
    if quantity is None or not quantity.peak or (outside and quantity.unit == "deg"):
        return figure
    return float(np.fmax(figure, row[quantity.peak]))


def _ratio(row: Mapping[str, Any]) -> float:
    """Compute how many times its limit the largest figure is; infinite where there is none."""
    peak, most = _peak(row), _most(row)
    return inf if isnan(peak) or isnan(most) else peak / most


def _told(row: Mapping[str, Any]) -> dict[str, Any]:
    """Write a case for people."""
    reason, quantity = row["outcome_reason"], QUANTITIES.get(row["outcome_reason"])
    step = int(row["outcome_step"]) if isfinite(row["outcome_step"]) else -1
    message = str(row["message"] or reason or "no reason is known")
    short = message[:LONGEST_MESSAGE] + "..." * (len(message) > LONGEST_MESSAGE)
    values = (row["outcome_figure"], _most(row), _peak(row))
    figure, most, peak = ("" if quantity is None else _with_unit(v, quantity) for v in values)
    return {
        "formulation": contender_name(row["formulation"], row["solver"]),
        "scenario": row["scenario"],
        "reference": row["reference"],
        "seed": int(row["seed"]),
        "plant": row["plant"],
        "outcome": row["outcome"] + ("" if row["counts"] else " (does not count)"),
        "at step": f"{step} of {int(row['steps'])}" if step >= 0 else "",
        "what": short if quantity is None else quantity.name,
        "figure": figure,
        "at most": most,
        "largest": peak,
        "trials": int(row["number"]),
        "id": str(row["id"])[:ID_DIGITS],
    }


def _with_unit(value: float, quantity: Quantity) -> str:
    if isnan(value):
        return "not known"
    if value == inf:
        return "none does"
    if not quantity.unit:
        return f"{value:.5g}"  # what is just beyond 1.001 is seen to be
    text = f"{shown(value * quantity.per_unit)} {quantity.unit}"
    if quantity.unit == "deg":
        text += f" or {shown(value * 1e3)} mm"  # of a joint that slides: a row does not say which
    return text
