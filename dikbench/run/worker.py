"""What a worker process does: build a trial, run it, measure it."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any

from dikbench.errors import DikbenchError
from dikbench.metrics import evaluate
from dikbench.motion import recompute
from dikbench.plants import PLANTS
from dikbench.problem import program_of
from dikbench.registry import make_formulation, make_scenario
from dikbench.scenario import Scenario
from dikbench.simulation import ReferenceMode, simulate
from dikbench.solvers.catalogue import parse_solver
from dikbench.solvers.checked import CheckedSolve, make_solve
from dikbench.status import Status
from dikbench.trial import NO_SOLVER, Trial

Row = dict[str, Any]
"""One trial as it stands in the table: column -> value."""


@lru_cache(maxsize=32)
def scenario_of(selector: str, seed: int) -> Scenario:
    """The scenario of a trial, built once per process."""
    return make_scenario(selector, seed)


def solve_of(formulation: str, solver: str, *, checks: bool = True) -> CheckedSolve:
    """A fresh `solve` for a law and a solver, both given by their selectors."""
    program = program_of(make_formulation(formulation))
    named = None if solver == NO_SOLVER else parse_solver(solver)
    return make_solve(named, program, checks=checks)


def header(trial: Trial) -> Row:
    """The columns that say which trial a row is of."""
    return {
        "formulation": trial.formulation,
        "solver": trial.solver,
        "scenario": trial.scenario,
        "plant": trial.plant,
        "reference": trial.reference,
        "seed": trial.seed,
    }


def row_without_run(trial: Trial, status: Status, message: str) -> Row:
    """The row of a trial of which nothing can be measured."""
    return {**header(trial), "status": status.value, "message": message, "steps": 0}


def run_trial(trial: Trial, traces: Path | None) -> Row:
    """Run one trial.

    Args:
        trial: the cell.
        traces: folder for its trace, or None.

    Returns:
        Its row: keys, status, message, number of steps, every metric; `wall_time_s` of the run and
        of it `control_time_s`, in kinematics, law and solver (the rest is the harness's).
    """
    try:
        scenario = scenario_of(trial.scenario, trial.seed)
    except DikbenchError as error:
        return row_without_run(trial, Status.SKIPPED, str(error))
    if trial.reference == "path" and not scenario.reference.moving:
        reason = "the scenario has no path that could wait for the robot"
        return row_without_run(trial, Status.SKIPPED, reason)
    mode: ReferenceMode = "path" if trial.reference == "path" else "time"
    start = perf_counter()
    run = simulate(
        scenario,
        make_formulation(trial.formulation),
        solve_of(trial.formulation, trial.solver),
        PLANTS[trial.plant],
        mode,
    )
    if traces is not None:
        run.trace.save(traces / f"{trial.id}.arrow")
    metrics = {}
    if run.trace.steps:
        metrics = evaluate(recompute(run.trace, scenario, run.jacobians))
    return {
        **header(trial),
        "status": run.status.value,
        "message": run.message,
        "steps": run.trace.steps,
        **metrics,
        "wall_time_s": perf_counter() - start,
        "control_time_s": (run.kinematics_ns + run.law_ns) / 1e9,
    }
