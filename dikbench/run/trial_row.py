"""The work of a worker process: build a trial, run it, measure it."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

from dikbench.errors import DikbenchError
from dikbench.metrics import Measured, Outcome, measure
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import (
    DikProblem,
    program_of,
    refusal_of,
    sees_constraints,
    sees_lower_tasks,
    sees_weights,
)
from dikbench.robots.kinematics import Kinematics
from dikbench.run.provenance import environment
from dikbench.run.worker_process import restore_process
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.oracle_formulation import oracle_of
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.study.trial import NO_SOLVER, Trial

TrialRow = dict[str, Any]
"""The row of a trial: column -> value."""

TracePolicy = Literal["all", "failures", "none"]


class CannotStore(DikbenchError):
    """A trace cannot be written, which ends the run; committed rows are kept."""


@lru_cache(maxsize=32)
def scenario_of(selector: Selector, seed: int) -> Scenario:
    """Return the scenario of a trial, built once per process."""
    return make_scenario(selector, seed)


def solve_of(formulation: Selector, solver: Selector, *, checks: bool = True) -> CheckedSolve:
    """Make a fresh `solve` for a formulation and a solver."""
    program = program_of(make_formulation(formulation))
    named = None if solver == NO_SOLVER else parse_solver(solver)
    return make_solve(named, program, checks=checks)


def row_without_run(trial: Trial, status: Status, message: str) -> TrialRow:
    """Make the row of a trial of which nothing can be measured."""
    row = {**trial.row, "status": status.value, "message": message, "steps": 0}
    if status is Status.SKIPPED:
        return row
    did_not_run = Outcome.DID_NOT_RUN.value
    return {**row, "outcome": did_not_run, "decided_before": did_not_run}


@lru_cache(maxsize=4)
def _environment(commit: str | None, command: str) -> TrialRow:
    return environment(commit, command)


def work(
    trial: Trial, trace: Path, policy: TracePolicy, commit: str | None, command: str
) -> tuple[TrialRow, TrialRow]:
    """Run a trial in a worker process; any failure of its plug-ins becomes a status.

    Args:
        trial: the cell.
        trace: file for its trace.
        policy: whether the trace is kept.
        commit: see `environment`.
        command: see `environment`.

    Returns:
        Its row, and the description of this process.

    Raises:
        CannotStore: if the trace cannot be written.
    """
    restore_process()
    try:
        row = run_trial(trial, trace, policy)
    except CannotStore:
        raise
    except MemoryError as error:
        row = row_without_run(trial, Status.OUT_OF_MEMORY, f"out of memory: {error}".rstrip(": "))
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".partition("\n")[0]
        row = row_without_run(trial, Status.FORMULATION_ERROR, reason)
    except BaseException as error:  # such as SystemExit
        reason = f"the formulation asked the process to end: {type(error).__name__}"
        row = row_without_run(trial, Status.CRASHED, reason)
    restore_process()
    return row, _environment(commit, command)


def run_trial(trial: Trial, trace: Path | None = None, policy: TracePolicy = "all") -> TrialRow:
    """Run one trial.

    Args:
        trial: the cell.
        trace: file for its trace, or None.
        policy: whether the trace is kept.

    Returns:
        Its row: keys, status, message, number of steps, every metric, the outcome; what the
        formulation sees of the problem, where there is something to see; `wall_time_s` of the run
        and `control_time_s` in kinematics, formulation and solver.

    Raises:
        CannotStore: if the trace cannot be written.
    """
    try:
        scenario = scenario_of(trial.scenario, trial.seed)
        problem = first_problem(scenario)
    except DikbenchError as error:
        return row_without_run(trial, Status.SKIPPED, str(error))
    if trial.reference == "path" and not scenario.reference.moving:
        reason = "the scenario has no path that could wait for the robot"
        return row_without_run(trial, Status.SKIPPED, reason)
    oracle = trial.formulation.name in ORACLES
    formulation = (
        oracle_of(trial.formulation.name, scenario)
        if oracle
        else make_formulation(trial.formulation)
    )
    if formulation is None:
        reason = "no joint motion is known that does what the scenario asks for"
        return row_without_run(trial, Status.SKIPPED, reason)
    reason = "" if oracle else refusal_of(formulation, problem)
    sight = {
        "sees_constraints": None if oracle else sees_constraints(formulation, problem),
        "sees_lower_tasks": None if oracle else sees_lower_tasks(formulation, problem),
        "sees_weights": None if oracle else sees_weights(formulation, problem),
    }
    if reason:
        row = {**row_without_run(trial, Status.SKIPPED, reason), **sight}
        if sight["sees_constraints"] is False:
            row["outcome"] = row["decided_before"] = Outcome.DOES_NOT_SEE.value
        return row
    plant = make_plant(trial.plant)
    mode: ReferenceMode = "path" if trial.reference == "path" else "time"
    start = perf_counter()
    run = simulate(
        scenario,
        formulation,
        make_solve(None, None) if oracle else solve_of(trial.formulation, trial.solver),
        plant,
        mode,
        trial.seed,
    )
    if trace is not None and (
        policy == "all" or (policy == "failures" and run.status is not Status.OK)
    ):
        _keep(run.trace.save, trace)
    # Noise makes the Jacobians that the formulation had differ from the true motion's.
    jacobians = None if plant.noise else run.jacobians
    metrics = measure([Measured(run.trace, scenario, jacobians, run.status)])[0]
    return {
        **row_without_run(trial, run.status, run.message),
        "steps": run.trace.steps,
        **metrics,
        **sight,
        "wall_time_s": perf_counter() - start,
        "control_time_s": (run.kinematics_ns + run.formulation_ns) / 1e9,
    }


def first_problem(scenario: Scenario) -> DikProblem:
    """The problem of a scenario's first control step."""
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    task = scenario.tracking.linearize(kinematics, *scenario.target(0.0))
    tasks, constraints = scenario.tasks, scenario.constraints
    return pose_problem(kinematics, scenario.v0, scenario.dt, task, tasks, constraints)


def _keep(save: Any, path: Path) -> None:
    """Write a trace and move it into place."""
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        save(partial)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        reason = error.strerror or str(error)
        raise CannotStore(f"trace {path} cannot be written: {reason}") from None
