"""The rows of the page: outcomes at every tolerance, weights, parameters, what is not run."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
from makers.played import chosen, expected

from dikbench.metrics import Judgement
from dikbench.plugins.building import make_formulation
from dikbench.report.interactive import page_rows as page_rows_module
from dikbench.report.interactive.page_rows import page_rows, variant
from dikbench.report.selection.categories import CATEGORIES
from dikbench.run.again import same_here
from dikbench.statistics.success import counted, rates, succeeded, with_facts


def test_rates_are_those_of_the_tables(trials: pd.DataFrame, rows: pd.DataFrame) -> None:
    """What the page weighs is what `statistics.success` weighs."""
    facts = with_facts(trials)
    part = counted(facts[facts["plant"].eq("ideal")], "path")
    found = rates(part, succeeded(part))
    wanted = dict(zip(found.contenders.itertuples(index=False, name=None), found.rate, strict=True))
    of_page = expected(chosen(rows, solver="any", variant="any"))
    laws = rows.drop_duplicates("contender").set_index("contender")[["formulation", "solver"]]
    for law, (rate, _) in of_page.items():
        assert rate == pytest.approx(100 * wanted[tuple(laws.loc[law])]), law


def test_outcomes_are_those_of_the_judgement(trials: pd.DataFrame, rows: pd.DataFrame) -> None:
    """At the scenario's own tolerance the stored outcome; success grows with the tolerance."""
    stored = trials.set_index("id")["outcome"]
    for trial, outcomes in zip(rows["id"], rows["outcomes"], strict=True):
        assert stored[trial] in CATEGORIES[int(outcomes[0])].outcomes
        kept = [int(digit == "0") for digit in outcomes[1:7]]
        assert kept == sorted(kept)
        assert all(a <= b for a, b in zip(kept, (int(d == "0") for d in outcomes[8:]), strict=True))
    one: Any = trials[trials["id"].eq(rows["id"].iloc[0])].to_dict("records")[0]
    at_2_mm = Judgement.of_row(one).at(0.002).outcome
    assert at_2_mm in CATEGORIES[int(rows["outcomes"].iloc[0][2])].outcomes


def records_of(rows: pd.DataFrame) -> list[Any]:
    """Rows as dictionaries."""
    return rows.to_dict("records")


def test_code_in_a_file_is_not_run(tmp_path: Path, trials: pd.DataFrame) -> None:
    """Rows may come from elsewhere: what they name is neither imported nor run again."""
    file = tmp_path / "intruder.py"
    file.write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    named = trials.assign(formulation=f"{file}:Law", formulation_name=f"{file}:Law")
    assert set(page_rows(named)["variant"]) == {"default"}
    assert same_here(records_of(named)) == []
    elsewhere = trials.assign(scenario=f"{file}:Family", scenario_family=f"{file}:Family")
    page_rows(elsewhere)
    assert same_here(records_of(elsewhere)) == []
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("status", ["timeout", "crashed", "out-of-memory", "formulation-error"])
def test_what_did_not_end_by_itself_is_not_run_again(trials: pd.DataFrame, status: str) -> None:
    """It would hold up or end the process of the report; what ended is the same here."""
    rows = records_of(trials[trials["status"].eq("ok")])
    assert len(same_here(rows)) == len(rows) > 0
    assert same_here([{**row, "status": status} for row in rows]) == []
    assert same_here([{**row, "id": "of another source"} for row in rows]) == []


def test_parameters_are_defaults_tuned_or_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """By value, not by how they are written; a switch is neither, for it is not tuned."""
    tuned = {"dls": SimpleNamespace(parameters={"damping": 0.02}), "lm": NOTHING_BETTER}
    monkeypatch.setattr(page_rows_module, "read_tuned", lambda file: tuned)
    own = make_formulation("dls").damping  # type: ignore[attr-defined]
    assert variant("dls") == variant(f"dls[damping={own}]") == "default"
    assert variant(f"dls[damping={own:e}]") == "default"
    assert variant("dls[damping=0.02]") == variant("dls[damping=2e-2]") == "tuned"
    assert variant("dls[damping=0.3]") == "other"
    assert variant("lm") == "both"
    assert variant("pinv[after=scale]") == "both"
    assert variant("not-known-here") == "default"
    assert variant("not-known-here[gain=2]") == "other"


NOTHING_BETTER = SimpleNamespace(parameters={})
"""What tuning froze where no point was better than the defaults."""


def test_a_step_takes_its_kinematics_as_well(trials: pd.DataFrame, rows: pd.DataFrame) -> None:
    """The deadline is of whole steps: a peer, whose call has its kinematics in it, is no slower."""
    timed = trials[trials["formulation_time_p99_us"].notna()]
    step = timed["kinematics_time_median_us"] + timed["formulation_time_p99_us"]
    wanted = step.groupby([timed["formulation"], timed["solver"]]).max()
    found = rows.groupby(["formulation", "solver"])["deadline"].first()
    assert found.to_dict() == pytest.approx(wanted.reindex(found.index).to_dict(), nan_ok=True)


def test_who_refuses_the_difficult_is_not_ranked_by_the_rest(rows: pd.DataFrame) -> None:
    """`pinv[after=clip]` was asked in one scenario only: it has fewer trials than the others."""
    counts = chosen(rows).groupby("contender").size()
    assert counts["pinv[after=clip]"] < counts.max()
