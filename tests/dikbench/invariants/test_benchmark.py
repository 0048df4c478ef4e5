"""The invariants hold of a study of two robots and six families, and each can be broken."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
from makers.played import chosen, expected
from makers.runs import run_here

from dikbench.invariants import INVARIANTS, Invariant, with_straw_laws
from dikbench.invariants.of_rows import is_straw
from dikbench.metrics import Outcome
from dikbench.report.interactive.page_rows import page_rows
from dikbench.results.reading import read_results, without_attributes
from dikbench.run.in_workers import RunSettings
from dikbench.study.study import Cells, Study

STUDY = Study(
    description="Two robots, six families",
    name="invariants",
    cells=(
        Cells(("pinv[after=scale]", "dls")),
        Cells(("lp-alpha", "qp"), ("daqp[then=clarabel]", "clarabel")),
    ),
    scenarios=(
        "near-miss[miss=0.02,speed=0.5,dt=0.02]",
        "near-miss[robot=panda,miss=0.02,dt=0.02]",
        "speed-sweep[robot=ur5,laps=1,speed=1.3,dt=0.02]",
        "pick-and-place[robot=panda,dt=0.02]",
        "joint-limit-crossing[robot=ur5,dt=0.02]",
        "step[robot=panda,duration=1.5,dt=0.02]",
        "hold-still[robot=ur5,dt=0.05]",
    ),
    plants=("ideal",),
    references=("time", "path"),
    seeds=(1,),
)


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """Run the study once, with straw laws."""
    out = tmp_path_factory.mktemp("invariants")
    run_here(with_straw_laws(STUDY), out, RunSettings(jobs=2, traces="none"), "test")
    return without_attributes(read_results(out)).trials


@pytest.mark.parametrize("invariant", INVARIANTS, ids=lambda each: each.sentence)
def test_invariants_hold(rows: pd.DataFrame, invariant: Invariant) -> None:
    """Of every row, straw laws and oracles included."""
    assert list(invariant.broken(rows)) == []


def test_the_study_has_what_the_invariants_are_about(rows: pd.DataFrame) -> None:
    """Successes, recoveries and failures; oracles in all that moves; straw laws everywhere."""
    ran = rows[rows["status"] != "skipped"]
    found = set(ran["outcome"])
    assert {"success", "recovered", "not-recovered", "limit-broken", "unfinished"} <= found
    assert ran[is_straw(ran)]["formulation"].nunique() == 5
    assert ran["formulation"].eq("slowed-oracle").sum() > 6
    assert ran["situation"].nunique() >= 4


def _where(rows: pd.DataFrame, name: str, **changed: object) -> pd.DataFrame:
    """Change the first row of a formulation that ran and is judged by its path."""
    fits = rows["formulation"].str.endswith(name) & rows["judged_by_path"].eq(1)
    other = rows.copy()
    place = fits.idxmax()
    for column, value in changed.items():
        other.loc[place, column] = value  # type: ignore[call-overload]
    return other


FAULTS: list[Callable[[pd.DataFrame], pd.DataFrame]] = [
    lambda rows: _where(rows, "oracle", tracking_error_6d_max_m=2e-4),
    lambda rows: _where(rows, "slowed-oracle", outcome=Outcome.LATE.value),
    lambda rows: _where(rows, "dls", tracking_error_6d_rms_m=-1e-3),
    lambda rows: _where(rows, "Idle", outcome=Outcome.SUCCESS.value),
    lambda rows: _where(rows, "Jittery", outcome=Outcome.SUCCESS.value),
    lambda rows: _where(rows, "dls", outcome=Outcome.COLLIDED.value),
    lambda rows: _where(rows, "dls", outcome="fine"),
]


@pytest.mark.parametrize("number", range(len(FAULTS)))
def test_each_invariant_is_seen_to_break(rows: pd.DataFrame, number: int) -> None:
    """One changed figure, and the trial is named."""
    broken = list(INVARIANTS[number].broken(FAULTS[number](rows)))
    assert broken
    assert "near-miss" in broken[0]


def test_rates_that_depend_on_repetition_are_named(
    rows: pd.DataFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mean over all trials is not one over families: scenarios run twice would weigh more."""
    from dikbench.statistics import success

    monkeypatch.setattr(
        success, "hierarchical_weights", lambda cases: np.arange(1.0, len(cases) + 1)
    )
    assert list(INVARIANTS[-1].broken(rows))


@pytest.mark.parametrize("reference", ["time", "path"])
def test_no_straw_law_is_the_best_of_a_page(rows: pd.DataFrame, reference: str) -> None:
    """Nor of a situation of it: in its ranking the places go by the rate of success alone."""
    page = page_rows(rows)
    straw = page["formulation"].isin(rows.loc[is_straw(rows), "formulation"])
    assert straw.any()
    view = chosen(page.assign(straw=straw), reference=reference)
    for part in (view, *(part for _, part in view.groupby("situation"))):
        rate = {name: value for name, (value, _) in expected(part).items()}
        of_straw = set(part.loc[part["straw"], "contender"])
        others = max(value for name, value in rate.items() if name not in of_straw)
        assert all(rate[name] < others or others == 100 for name in of_straw), rate
