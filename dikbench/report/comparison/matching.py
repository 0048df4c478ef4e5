"""Trials of two results folders, matched by what was selected."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final, Literal

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.results.columns import SELECTORS, TRIAL
from dikbench.results.selected import selected_columns
from dikbench.simulation.status import Status
from dikbench.study.trial import Trial

Best = Literal["low", "high"]
"""What is best of a metric."""

RANKS: Final[Mapping[str, int]] = MappingProxyType({Status.OK.value: 2, Status.SKIPPED.value: 1})
"""How good a status is; every other one is a failure, 0."""

MOST_STEPS: Final = 0.5
"""A solver that fails in more than this share of a trial's steps fails in the trial."""


@dataclass(frozen=True, eq=False)
class MatchedTrials:
    """The trials of two folders, A and B.

    Attributes:
        a, b: the rows of the trials that both have, row by row the same trial.
        only_a, only_b: the trials that one of them has alone, columns `TRIAL` and `status`.
        metrics: the metrics that both have, in the registry's order, and what is best of each.
        unmatched_columns: what is said of metrics that are not compared.
    """

    a: pd.DataFrame
    b: pd.DataFrame
    only_a: pd.DataFrame
    only_b: pd.DataFrame
    metrics: Mapping[str, Best]
    unmatched_columns: tuple[str, ...]

    @cached_property
    def rank_change(self) -> pd.Series:
        """How much better the status became: negative where a trial newly fails or is skipped."""
        ranks = [rows["status"].map(RANKS).fillna(0).astype(int) for rows in (self.a, self.b)]
        return ranks[1] - ranks[0]

    @property
    def newly_failed(self) -> int:
        """Number of trials that end worse in B."""
        return int((self.rank_change < 0).sum())

    @property
    def missing(self) -> int:
        """Number of trials that ran in A and that B lacks."""
        return int(self.only_a["status"].ne(Status.SKIPPED.value).sum())

    @cached_property
    def solver_newly_fails(self) -> pd.Series:
        """Whether a trial's solver fails in steps in B and in none in A, or newly in most."""
        if "solver_failed_share" not in self.metrics:
            return pd.Series(False, self.a.index)
        before, after = (rows["solver_failed_share"].fillna(0.0) for rows in (self.a, self.b))
        return (after.gt(0) & before.eq(0)) | (after.gt(MOST_STEPS) & before.le(MOST_STEPS))

    @cached_property
    def status_changes(self) -> pd.DataFrame:
        """The trials whose status changed, those that became worse first."""
        changes = self.a[TRIAL].assign(
            status_a=self.a["status"],
            status_b=self.b["status"],
            message_b=self.b["message"],
            change=self.rank_change,
        )
        changed = changes[self.a["status"] != self.b["status"]]
        return changed.sort_values("change", kind="stable").drop(columns="change")

    @cached_property
    def both_ok(self) -> pd.Series:
        """Whether a trial ran to its end in both: a motion that broke off has no numbers here."""
        return self.a["status"].eq(Status.OK.value) & self.b["status"].eq(Status.OK.value)

    @property
    def other_ids(self) -> int:
        """Number of trials whose formulation or scenario has another source in B."""
        if "id" not in self.a or "id" not in self.b:
            return 0
        return int((self.a["id"] != self.b["id"]).sum())


def match_trials(
    a: pd.DataFrame,
    b: pd.DataFrame,
    names: tuple[str, str] = ("A", "B"),
    others: Mapping[str, Best] = MappingProxyType({}),
) -> MatchedTrials:
    """Match the trials of two folders by formulation, solver, scenario, plant, reference and seed.

    Args:
        a: the rows of trials.csv of the one.
        b: of the other.
        names: how the folders are called in errors.
        others: the metrics of other authors that are the same in both, and what is best of each.

    Raises:
        DikbenchError: if one is empty or holds a trial twice, or they have no trial or no metric in
            common.
    """
    b = _in_the_words_of(a, b)
    for rows, name in zip((a, b), names, strict=True):
        if rows.empty:
            raise DikbenchError(f"{name} holds no trials")
        twice = rows[rows.duplicated(TRIAL)]
        if len(twice):
            raise DikbenchError(
                f"{name} holds a trial twice: {trial_name(twice.iloc[0].to_dict())}"
            )
    both = a[TRIAL].assign(at_a=range(len(a))).merge(b[TRIAL].assign(at_b=range(len(b))), on=TRIAL)
    if both.empty:
        raise DikbenchError(f"{names[0]} and {names[1]} have no trial in common")
    every = {**{name: metric.best for name, metric in METRICS.items()}, **others}
    metrics = {name: best for name, best in every.items() if name in a and name in b}
    if not metrics:
        raise DikbenchError(f"{names[0]} and {names[1]} have no metric in common")
    return MatchedTrials(
        a.iloc[both["at_a"]].reset_index(drop=True),
        b.iloc[both["at_b"]].reset_index(drop=True),
        a.drop(a.index[both["at_a"]])[[*TRIAL, "status"]],
        b.drop(b.index[both["at_b"]])[[*TRIAL, "status"]],
        metrics,
        _unmatched_columns(a, b),
    )


def _in_the_words_of(a: pd.DataFrame, b: pd.DataFrame) -> pd.DataFrame:
    """Return B, its trials that have an id of A's selected in the words of A.

    The same trial may be selected in other words, with a default spelt out for example.
    """
    if "id" not in a or "id" not in b:
        return b
    words = a.drop_duplicates("id").set_index("id")[TRIAL]
    same = b["id"].isin(words.index)
    renamed = {name: b["id"].map(words[name]).where(same, b[name]) for name in TRIAL}
    return b.assign(**renamed).astype({"seed": b["seed"].dtype})


def trial_name(row: Mapping[Any, Any]) -> str:
    """Name the trial of a row in words."""
    return str(Trial.of(**{name: row[name] for name in TRIAL}))


def _own_columns(rows: pd.DataFrame) -> pd.Index:
    """Return the columns that the folder itself has, without the parts of selectors."""
    parts = {
        name
        for column, head in SELECTORS.items()
        for name in (f"{column}_{head}", *selected_columns(rows, column).values())
    }
    return rows.columns.difference(list(parts))


def _unmatched_columns(a: pd.DataFrame, b: pd.DataFrame) -> tuple[str, ...]:
    said = []
    for name, other, columns in (
        ("A", "B", _own_columns(a).difference(_own_columns(b))),
        ("B", "A", _own_columns(b).difference(_own_columns(a))),
    ):
        if len(columns):
            said.append(f"{name} has {', '.join(columns)}, which {other} lacks")
    return tuple(said)
