"""Formulations of one optimum have equal outcomes, whatever solves them."""

from __future__ import annotations

import pytest

from dikbench.run.trial_row import run_trial
from dikbench.study.trial import Trial

SCENARIOS = (
    "near-miss[miss=0.02,dt=0.01]",
    "speed-sweep[speed=1.3,laps=1,dt=0.02]",
    "joint-limit-graze[robot=panda,dt=0.02]",
    "step[robot=panda,duration=1.5]",
)

EQUAL = (
    (("lp-alpha", "daqp[then=clarabel]"), ("lp-alpha-cvxpy", "clarabel")),
    (("qp", "daqp"), ("qp", "daqp[interface=warm]"), ("qp", "piqp[preset=high]")),
)


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("equal", EQUAL, ids=["lp-alpha", "qp"])
def test_equal_formulations_have_equal_outcomes(
    scenario: str, equal: tuple[tuple[str, str], ...]
) -> None:
    """By the clock and by the path; of solvers whose answers all pass the recheck."""
    for reference in ("time", "path"):
        if reference == "path" and scenario.startswith("step"):
            continue
        outcomes = set()
        for formulation, solver in equal:
            trial = Trial.of(formulation, scenario, solver, "ideal", reference, 0)
            row = run_trial(trial, None, "none")
            if row["not_verified_share"] == 0:
                outcomes.add(row["outcome"])
        assert len(outcomes) == 1, outcomes
