"""Recomputes metrics and outcomes from stored traces, so that a changed one needs no rerun."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Future, as_completed
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.metrics import (
    described,
    evaluate,
    evaluate_others,
    motion_of,
    other_metrics,
    outcome_columns,
    take_errors,
)
from dikbench.results.folder import ResultsFolder
from dikbench.results.store import Store
from dikbench.results.stored_trial import StoredTrial
from dikbench.run.other_metrics import tell
from dikbench.run.pool import workers
from dikbench.run.progress_display import ProgressDisplay
from dikbench.run.provenance import environment, git_commit
from dikbench.run.runner import Interrupted
from dikbench.run.trial_row import scenario_of
from dikbench.run.worker_process import restore_process
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.status import Status
from dikbench.simulation.trace import Trace
from dikbench.study.identity import trial_id_today

STATUSES: Final = MappingProxyType({status.value: status for status in Status})
"""Statuses by their names."""


@dataclass(frozen=True)
class Recomputed:
    """The outcome of a recomputation; trials that are not recomputed keep their values.

    Attributes:
        done: number of trials whose metrics were recomputed.
        without_trace: number of trials with steps whose trace was not kept.
        changed: number of trials whose formulation or scenario has changed.
        failed: reasons why traces cannot be used, by the name of the trial.
    """

    done: int
    without_trace: int
    changed: int
    failed: dict[str, str]

    def __str__(self) -> str:
        """Summarise in one line."""
        kept = {
            "without a trace": self.without_trace,
            "whose formulation or scenario has changed since": self.changed,
            "whose trace cannot be used": len(self.failed),
        }
        left = [f"{number} {why}" for why, number in kept.items() if number]
        rest = f"; left as they were: {', '.join(left)}" if left else ""
        return f"{self.done} trials recomputed{rest}"


def recompute_results(
    out: Path, jobs: int, command: str, metrics: Sequence[str] = ()
) -> Recomputed:
    """Compute metrics and outcomes of a results folder again from its traces, and export it.

    A trial is recomputed only if its formulation and scenario are unchanged.

    Args:
        out: results folder.
        jobs: number of worker processes.
        command: the command line, for the manifest.
        metrics: metrics of other authors, in addition to those that the folder has.

    Raises:
        DikbenchError: if a metric is unknown, the folder has no results or no traces, or another
            run uses it.
        Interrupted: if the user stops it; what is finished is kept.
    """
    folder = ResultsFolder(out)
    folder.check_there()
    with folder.lock(), folder.open_store(add_metrics=True) as store:
        moved = [stored for stored in store.stored_trials() if stored.steps]
        traced = [stored for stored in moved if folder.trace(stored.id).is_file()]
        if moved and not traced:
            raise DikbenchError(
                f"no traces in {folder.traces}: they were not kept (`--traces none`), or removed"
            )
        todo = [stored for stored in traced if trial_id_today(stored.trial.row) == stored.id]
        there = [str(each["selector"]) for each in store.other_metrics.values()]
        metrics = tuple(dict.fromkeys([*there, *metrics]))
        store.add_other_metrics(described(other_metrics(metrics)))
        try:
            failed = _recompute(store, folder, todo, jobs, metrics)
        except KeyboardInterrupt:
            folder.export(store)
            raise Interrupted("what was recomputed is kept") from None
        made = environment(git_commit(), command)
        finished = datetime.now(UTC).isoformat(timespec="seconds")
        store.note("recomputed", {"finished": finished, **made})
        folder.export(store)
        store.close_neatly()
    done = len(todo) - len(failed)
    return Recomputed(done, len(moved) - len(traced), len(traced) - len(todo), failed)


def _recompute(
    store: Store,
    folder: ResultsFolder,
    todo: Sequence[StoredTrial],
    jobs: int,
    metrics: Sequence[str],
) -> dict[str, str]:
    """Recompute trials in worker processes and commit each; return the reasons of failures."""
    failed: dict[str, str] = {}
    errors: dict[str, str] = {}
    # In the order of scenarios, so that a worker builds each once.
    order = sorted(todo, key=lambda stored: (str(stored.trial.scenario), stored.trial.seed))
    with (
        workers(jobs, (__name__,)) as pool,
        ProgressDisplay(len(todo), "recomputed trials") as display,
    ):
        futures: dict[Future[Any], StoredTrial] = {
            pool.schedule(metrics_of, args=(stored, folder.trace(stored.id), metrics)): stored
            for stored in order
        }
        for future in as_completed(futures):
            stored = futures[future]
            try:
                found = future.result()
            except Exception as error:  # a plug-in's scenario may raise anything
                failed[f"{stored.trial} ({stored.id})"] = " ".join(str(error).split())
            else:
                take_errors(found, errors)
                store.record_metrics(stored.id, found)
            display.advance()
    for name, reason in failed.items():
        print(f"not recomputed: {name}: {reason}", file=sys.stderr)
    tell(errors)
    return failed


def metrics_of(stored: StoredTrial, file: Path, metrics: Sequence[str] = ()) -> dict[str, Any]:
    """Compute the metrics and the outcome of a trial from its trace, in a worker process.

    Raises:
        DikbenchError: if the trace cannot be read, or is not one of this trial.
    """
    restore_process()
    scenario = scenario_of(stored.trial.scenario, stored.trial.seed)
    trace = Trace.load(file)
    _check_fits(trace, scenario, stored.steps, file)
    motion = motion_of(trace, scenario)
    return {
        **evaluate(motion),
        **evaluate_others(motion, other_metrics(metrics)),
        **outcome_columns(motion, STATUSES[stored.status]),
    }


def _check_fits(trace: Trace, scenario: Scenario, steps: int, file: Path) -> None:
    robot = scenario.robot
    found = (trace.dt, trace.q.shape, trace.applied.shape, trace.wanted.shape)
    expected = (
        scenario.dt,
        (steps + 1, robot.nq),
        (steps, robot.nv),
        (steps, len(scenario.rows)),
    )
    if found != expected:
        raise DikbenchError(f"trace {file}: not of this trial: {found} instead of {expected}")
