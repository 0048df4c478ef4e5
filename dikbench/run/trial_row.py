"""The work of a worker process: build a trial, run it, measure it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any, Literal

from dikbench.errors import DikbenchError
from dikbench.metrics import Measured, Outcome, measure, other_metrics
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem.posing import pose_problem
from dikbench.problem.problem import (
    DikProblem,
    Formulation,
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
from dikbench.scenario.plant import Plant
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import Run, simulate
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
def described(commit: str | None, command: str) -> TrialRow:
    """Describe this process (see `environment`), once."""
    return environment(commit, command)


def work(
    trial: Trial,
    trace: Path | None,
    policy: TracePolicy,
    commit: str | None,
    command: str,
    metrics: Sequence[str] = (),
) -> tuple[TrialRow, TrialRow]:
    """Run a trial in a worker process; any failure of its plug-ins becomes a status.

    Args:
        trial: the cell.
        trace: file for its trace, or None.
        policy: whether the trace is kept.
        commit: see `environment`.
        command: see `environment`.
        metrics: see `run_trial`.

    Returns:
        Its row, and the description of this process.

    Raises:
        CannotStore: if the trace cannot be written.
    """
    row = attempted(trial, lambda: run_trial(trial, trace, policy, metrics))
    return row, described(commit, command)


def attempted(trial: Trial, run: Callable[[], TrialRow]) -> TrialRow:
    """Run a trial; any failure of its plug-ins becomes a status, and the process is restored.

    Raises:
        CannotStore: if the trace cannot be written.
    """
    restore_process()
    try:
        row = run()
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
    return row


@dataclass(frozen=True, eq=False)
class Prepared:
    """A trial that can run, and what it consists of.

    Attributes:
        trial: the cell.
        scenario: its case.
        formulation: the formulation; an oracle of this run alone.
        plant: the measurement and the drive.
        sight: what the formulation sees of the problem (see `SEES`).
    """

    trial: Trial
    scenario: Scenario
    formulation: Formulation
    plant: Plant
    sight: Mapping[str, bool | None]

    @property
    def mode(self) -> ReferenceMode:
        """What advances the reference."""
        return "path" if self.trial.reference == "path" else "time"

    def solve(self) -> CheckedSolve:
        """Make a fresh solver."""
        if self.trial.formulation.name in ORACLES:
            return make_solve(None, None)
        return solve_of(self.trial.formulation, self.trial.solver)


def prepare(trial: Trial, scenario: Scenario) -> Prepared | TrialRow:
    """Make what a trial consists of, or its row where it cannot run.

    Raises:
        DikbenchError: if the scenario poses no problem.
    """
    problem = first_problem(scenario)
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
    return Prepared(trial, scenario, formulation, make_plant(trial.plant), sight)


def run_trial(
    trial: Trial,
    trace: Path | None = None,
    policy: TracePolicy = "all",
    metrics: Sequence[str] = (),
) -> TrialRow:
    """Run one trial.

    Args:
        trial: the cell.
        trace: file for its trace, or None.
        policy: whether the trace is kept.
        metrics: metrics of other authors that are computed in addition.

    Returns:
        Its row: keys, status, message, number of steps, every metric, the outcome; what the
        formulation sees of the problem, where there is something to see; `wall_time_s` of the run
        and `control_time_s` in kinematics, formulation and solver.

    Raises:
        CannotStore: if the trace cannot be written.
    """
    try:
        found = prepare(trial, scenario_of(trial.scenario, trial.seed))
    except DikbenchError as error:
        return row_without_run(trial, Status.SKIPPED, str(error))
    return run_prepared(found, trace, policy, metrics) if isinstance(found, Prepared) else found


def run_prepared(
    ready: Prepared, trace: Path | None, policy: TracePolicy, metrics: Sequence[str] = ()
) -> TrialRow:
    """Run a trial alone (see `run_trial`)."""
    start, trial = perf_counter(), ready.trial
    run = simulate(
        ready.scenario, ready.formulation, ready.solve(), ready.plant, ready.mode, trial.seed
    )
    [row] = rows_of([ready], [run], [trace], policy, metrics)
    row["wall_time_s"] = perf_counter() - start
    row["control_time_s"] = (run.kinematics_ns + run.formulation_ns) / 1e9
    return row


def rows_of(
    ready: Sequence[Prepared],
    runs: Sequence[Run],
    traces: Sequence[Path | None],
    policy: TracePolicy,
    metrics: Sequence[str] = (),
) -> list[TrialRow]:
    """Make the rows of runs that are finished, without times, and keep their traces.

    Raises:
        CannotStore: if a trace cannot be written.
    """
    for run, trace in zip(runs, traces, strict=True):
        if trace is not None and (
            policy == "all" or (policy == "failures" and run.status is not Status.OK)
        ):
            _keep(run.trace.save, trace)
    measured = [
        # Noise makes the Jacobians that the formulation had differ from the true motion's.
        Measured(run.trace, p.scenario, None if p.plant.noise else run.jacobians, run.status)
        for p, run in zip(ready, runs, strict=True)
    ]
    return [
        {
            **row_without_run(p.trial, run.status, run.message),
            "steps": run.trace.steps,
            **values,
            **p.sight,
        }
        for p, run, values in zip(
            ready, runs, measure(measured, other_metrics(metrics)), strict=True
        )
    ]


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
