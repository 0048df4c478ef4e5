"""Invariants of the rows of a study that was run together with straw laws and oracles."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import radians
from typing import Any, Final

import numpy as np
import pandas as pd

from dikbench.metrics import Judgement, Outcome
from dikbench.report.conclusions import conclusions
from dikbench.scenario.oracle import ORACLE, ORACLES, SLOWED_ORACLE
from dikbench.scenario.violation import SPEED_TOLERANCE
from dikbench.simulation.status import Status
from dikbench.statistics.failures import ran
from dikbench.statistics.success import DONE, counted, rates, succeeded, with_facts
from dikbench.testing.straw import STRAW_LAWS

EXACT_M: Final = 1e-4
"""The exact motion is at most so far from its target and from its path."""

EXACT_COURSE_RAD: Final = radians(1.0)
"""The exact motion is at most so far off the direction of its path."""

ROUNDING_M: Final = 1e-6
"""No formulation follows more closely than the exact motion by more than this."""

ROUNDING: Final = 1e-9
"""Rates and shares that differ by less are equal."""

LADDER_M: Final = (5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1)
"""The tolerances over which success must not fall."""

TRIAL: Final = ["formulation", "solver", "scenario", "plant", "reference", "seed"]


@dataclass(frozen=True)
class Invariant:
    """Something that holds of the rows of every study.

    Attributes:
        sentence: what holds.
        broken: finds the places where it does not, in words.
    """

    sentence: str
    broken: Callable[[pd.DataFrame], Iterator[str]]


def straw_law(rows: pd.DataFrame, name: str) -> pd.DataFrame:
    """Return the rows of a straw law, of those that ran."""
    found: pd.DataFrame = rows[is_straw(rows) & rows["formulation"].str.contains(f":{name}")]
    return ran(found)


def is_straw(rows: pd.DataFrame) -> pd.Series:
    """Say which rows are of straw laws."""
    names = "|".join(law.__name__ for law in STRAW_LAWS)
    found: pd.Series = rows["formulation"].str.contains(rf"straw\.py:(?:{names})(?:\[|$)")
    return found


def _oracle_is_exact(rows: pd.DataFrame) -> Iterator[str]:
    exact = ran(rows[rows["formulation"].eq(ORACLE)])
    moving = exact[exact["judged_by_path"].eq(1)]
    for column, most in (
        ("tracking_error_6d_max_m", EXACT_M),
        ("contour_error_6d_max_m", EXACT_M),
        ("lag_max_s", ROUNDING),
        ("course_rad", EXACT_COURSE_RAD),
    ):
        yield from _named(moving[moving[column] > most], column)
    yield from _named(moving[moving["path_done_share"] < 1 - ROUNDING], "path_done_share")
    feasible = exact["feasible"].eq("time") & exact["followable_until_s"].isna()
    yield from _named(exact[feasible & ~exact["outcome"].isin(DONE)], "outcome")


def _slowed_oracle_succeeds(rows: pd.DataFrame) -> Iterator[str]:
    slowed = ran(rows[rows["formulation"].eq(SLOWED_ORACLE)])
    feasible = slowed["feasible"].isin(["time", "path"])
    yield from _named(slowed[feasible & ~slowed["outcome"].isin(DONE)], "outcome")


def _nobody_beats_the_oracle(rows: pd.DataFrame) -> Iterator[str]:
    column, moving = "tracking_error_6d_rms_m", ran(rows[rows["judged_by_path"].eq(1)])
    exact = moving[moving["formulation"].eq(ORACLE)]
    least = exact.set_index(["scenario", "seed"])[column]
    by_clock = moving[moving["reference"].eq("time")]
    keys = pd.MultiIndex.from_frame(by_clock[["scenario", "seed"]])
    best = least.reindex(keys).to_numpy()
    yield from _named(by_clock[by_clock[column].to_numpy() < best - ROUNDING_M], column)


def _idlers_do_nothing(rows: pd.DataFrame) -> Iterator[str]:
    still = rows[rows["formulation"].eq(ORACLE) & rows["joint_travel_rad"].lt(ROUNDING)]
    asks_for_no_motion = rows["scenario"].isin(still["scenario"].unique())
    for name in ("Idle", "Creeper"):
        law = straw_law(rows, name)
        done = law["outcome"].isin(DONE) & ~asks_for_no_motion.reindex(law.index)
        recovered = law["outcome"].eq(Outcome.RECOVERED.value)
        yield from _named(law[done | recovered | law["coped"].eq(1)], "outcome")


def _shakers_and_the_reckless_fail(rows: pd.DataFrame) -> Iterator[str]:
    for name in ("Jittery", "Shaker"):
        law = straw_law(rows, name)
        limited = law["velocity_peak_ratio"].gt(0)
        yield from _named(law[limited & law["outcome"].isin(DONE)], "outcome")
    reckless = straw_law(rows, "Reckless")
    too_fast = reckless["velocity_peak_ratio"].gt(SPEED_TOLERANCE)
    yield from _named(reckless[too_fast & reckless["outcome"].isin(DONE)], "outcome")


def _success_grows_with_tolerance(rows: pd.DataFrame) -> Iterator[str]:
    judged = ran(rows)
    judged = judged[judged["judged_by_path"].notna()]
    records: list[Any] = judged.to_dict("records")
    fallen = np.zeros(len(judged), dtype=bool)
    for place, row in enumerate(records):
        judgement = Judgement.of_row(row)
        ladder = [judgement.at(tolerance).outcome.value in DONE for tolerance in LADDER_M]
        same = judgement.at(row["tolerance_m"]).outcome.value == row["outcome"]
        fallen[place] = ladder != sorted(ladder) or not same
    yield from _named(judged[fallen], "outcome")


def _outcomes_add_up(rows: pd.DataFrame) -> Iterator[str]:
    known = {outcome.value for outcome in Outcome}
    yield from _named(ran(rows)[~ran(rows)["outcome"].isin(known)], "outcome")
    skipped = rows[rows["status"].eq("skipped")]
    yield from _named(skipped[skipped["outcome"].isin(known)], "outcome")


def _straw_laws_change_no_conclusion(rows: pd.DataFrame) -> Iterator[str]:
    alone, together = conclusions(rows[~is_straw(rows)]), conclusions(rows)
    yield from (f"only without straw laws: {line}" for line in alone if line not in together)
    yield from (f"only with straw laws: {line}" for line in together if line not in alone)


def _one_failure_is_named(rows: pd.DataFrame) -> Iterator[str]:
    """One trial that did not run: conclusions are drawn, and say so of that formulation alone."""
    competing = rows[~rows["formulation"].isin(ORACLES) & ~is_straw(rows)]
    whole = ran(competing)
    if whole.empty or whole["outcome"].isin([Outcome.DID_NOT_RUN.value]).any():
        return
    place = whole.index[0]
    broken = competing.copy()
    broken.loc[place, ["status", "outcome", "decided_before"]] = [
        Status.CRASHED.value, Outcome.DID_NOT_RUN.value, Outcome.DID_NOT_RUN.value,
    ]  # fmt: skip
    said = [line for line in conclusions(broken) if line.startswith("Broke off")]
    name = str(whole.loc[place, "formulation"])
    others = set(whole["formulation"]) - {name}
    if len(said) != 1 or f"`{name}`" not in said[0]:
        yield f"a crash of {name} is not named: {said}"
    elif any(f"`{other}`" in said[0] for other in others):
        yield f"others are named: {said[0]}"


def _rates_keep(rows: pd.DataFrame) -> Iterator[str]:
    """Renamed, in another order, every scenario twice: the rates are the same."""
    trials = with_facts(rows)
    twice = pd.concat([trials, trials.assign(seed=trials["seed"] + 10**6)], ignore_index=True)
    renamed = trials.assign(formulation="x" + trials["formulation"])
    for change, other in (
        ("in reverse order", trials.iloc[::-1]),
        ("every scenario twice", twice),
        ("renamed", renamed),
    ):
        if not np.allclose(_overall(trials), _overall(other), atol=ROUNDING, equal_nan=True):
            yield f"rates are others {change}"


def _overall(trials: pd.DataFrame) -> list[float]:
    """Compute the rates of all formulations in both settings, in order of their size."""
    found: list[float] = []
    for setting in ("path", "time"):
        for _, of_plant in trials.groupby("plant", sort=True):
            rows = counted(of_plant, "path" if setting == "path" else "time")
            if len(rows):
                found += sorted(rates(rows, succeeded(rows)).rate.tolist())
    return found


def _named(rows: pd.DataFrame, column: str) -> Iterator[str]:
    """Name the trials of rows, with the value of a column."""
    for _, row in rows.iterrows():
        cell = " x ".join(str(row[name]) for name in TRIAL)
        yield f"{cell}: {column} = {row[column]}"


INVARIANTS: Final = (
    Invariant("The oracle is exact, and succeeds wherever it keeps all limits", _oracle_is_exact),
    Invariant("The slowed oracle succeeds wherever a motion is known", _slowed_oracle_succeeds),
    Invariant("No formulation follows more closely than the oracle", _nobody_beats_the_oracle),
    Invariant("Who stands still or creeps does nothing that asks for motion", _idlers_do_nothing),
    Invariant("Who shakes, or breaks limits, never succeeds", _shakers_and_the_reckless_fail),
    Invariant("Success does not fall when the tolerance grows", _success_grows_with_tolerance),
    Invariant("Every trial that ran has one outcome, and no other has", _outcomes_add_up),
    Invariant("Straw laws change no sentence and no star", _straw_laws_change_no_conclusion),
    Invariant("A single trial that did not run is named, alone", _one_failure_is_named),
    Invariant("Rates do not depend on names, order or repetition", _rates_keep),
)
"""Every invariant of rows."""
