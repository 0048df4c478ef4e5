"""The work of a worker process on a block of trials: those of one kind run in lockstep."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from pathlib import Path

from dikbench.errors import DikbenchError
from dikbench.plugins.building_together import make_scenarios
from dikbench.problem.problem import Formulation, is_batched
from dikbench.run.trial_row import (
    Prepared,
    TracePolicy,
    TrialRow,
    attempted,
    described,
    prepare,
    row_without_run,
    rows_of,
    run_prepared,
)
from dikbench.run.worker_process import restore_process
from dikbench.scenario.oracle import ORACLES
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector, parse_selector
from dikbench.simulation.lockstep import (
    LockstepRun,
    LockstepTrial,
    kind_of,
    simulate_together,
)
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER
from dikbench.study.trial import Trial


class BlockEnded(Exception):
    """Something of a block could not be run in lockstep."""


def work_together(
    trials: Sequence[Trial],
    traces: Sequence[Path],
    policy: TracePolicy,
    commit: str | None,
    command: str,
    metrics: Sequence[str] = (),
) -> tuple[list[TrialRow], TrialRow]:
    """Run a block of trials in a worker process (see `dikbench.run.trial_row.work`).

    Their scenarios are built together. Trials of one kind, formulation, solver, plant and clock run
    in lockstep, where the formulation answers many at once; the others run alone.

    Returns:
        Their rows in their order, and the description of this process.

    Raises:
        CannotStore: if a trace cannot be written.
        BlockEnded: if a formulation ends the lockstep of several trials.
    """
    restore_process()
    cells = list(dict.fromkeys((trial.scenario, trial.seed) for trial in trials))
    built: dict[tuple[Selector, int], Scenario | BaseException]
    try:
        built = dict(zip(cells, make_scenarios(cells), strict=True))
    except KeyboardInterrupt as error:  # a plug-in's own
        if len(trials) > 1:
            raise BlockEnded(f"{type(error).__name__}: {error}") from None
        built = {cells[0]: error}
    rows: dict[int, TrialRow] = {}
    alone: list[tuple[int, Prepared]] = []
    groups: dict[object, list[tuple[int, Prepared]]] = {}
    for number, trial in enumerate(trials):
        found = _prepared(trial, built[trial.scenario, trial.seed])
        if not isinstance(found, Prepared):
            rows[number] = found
            continue
        kind = kind_of_trial(found)
        if kind is None:
            alone.append((number, found))
        else:
            groups.setdefault(kind, []).append((number, found))
    together: list[tuple[int, Prepared, LockstepRun]] = []
    for group in groups.values():
        try:
            found_runs = in_lockstep([ready for _, ready in group])
        except BaseException as error:
            if len(trials) > 1:  # who it was is found out in smaller blocks
                raise BlockEnded(f"{type(error).__name__}: {error}") from None
            alone += group  # which says what is wrong of it
            continue
        together += [(*each, run) for each, run in zip(group, found_runs, strict=True)]
    made = rows_of(  # those of one scenario are measured together
        [ready for _, ready, _ in together],
        [each.run for _, _, each in together],
        [traces[number] for number, _, _ in together],
        policy,
        metrics,
    )
    for (number, _, each), row in zip(together, made, strict=True):
        rows[number] = {**row, "asked_alone_steps": each.asked_alone}
    for number, ready in alone:
        run = partial(run_prepared, ready, traces[number], policy, metrics)
        rows[number] = attempted(ready.trial, run)
    return [rows[number] for number in range(len(trials))], described(commit, command)


def _prepared(trial: Trial, scenario: Scenario | BaseException) -> Prepared | TrialRow:
    """Make what a trial consists of, or its row where it cannot run."""
    try:
        if isinstance(scenario, BaseException):
            raise scenario
        return prepare(trial, scenario)
    except DikbenchError as error:
        return row_without_run(trial, Status.SKIPPED, str(error))
    except BaseException as error:
        return attempted(trial, partial(_raise, error))


def _raise(error: BaseException) -> TrialRow:
    raise error


def kind_of_trial(ready: Prepared) -> object | None:
    """Return what trials must share to run in lockstep; None where one runs alone."""
    trial = ready.trial
    if trial.formulation.name in ORACLES or not is_batched(ready.formulation):
        return None
    kind = kind_of(ready.scenario)
    # A solver that starts from its last answer must be asked once a step, whatever comes of it.
    if kind is None or "interface=warm" in str(trial.solver):
        return None
    return kind, trial.plant, trial.reference


def in_lockstep(ready: Sequence[Prepared]) -> list[LockstepRun]:
    """Run trials of one kind (see `kind_of_trial`)."""
    first = ready[0]
    trials: list[LockstepTrial] = []
    known: dict[tuple[Selector, Selector], Formulation] = {}
    for each in ready:
        trial = each.trial
        formulation = known.setdefault((trial.formulation, trial.solver), each.formulation)
        guesses = _guesses(trial.solver)
        trials.append(LockstepTrial(each.scenario, formulation, each.solve(), trial.seed, guesses))
    restore_process()
    found = simulate_together(trials, first.plant, first.mode)
    restore_process()
    return found


@lru_cache(maxsize=256)
def _guesses(solver: Selector) -> bool:
    """Say whether minimisers may be guessed: for the default solver; another is asked always."""
    return any(solver == parse_selector(default) for default in DEFAULT_SOLVER.values())
