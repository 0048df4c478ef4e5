"""Trials that a search asks for, in worker processes that stay for all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from dikbench.run.block_work import WORK, row_of
from dikbench.run.in_workers import RunSettings
from dikbench.run.pool import workers
from dikbench.run.trial_row import TrialRow, row_without_run, work
from dikbench.simulation.status import Status
from dikbench.study.trial import Trial

Evaluate = Callable[[Sequence[Trial]], list[TrialRow]]
"""Runs trials and gives their rows in their order."""


@contextmanager
def in_workers(settings: RunSettings) -> Iterator[Evaluate]:
    """Give what runs trials, each alone as `dikbench run` runs a single one; no trace is kept."""
    with workers(settings.jobs, WORK, settings.trial_memory) as pool:
        yield evaluator(pool, settings.trial_timeout)


def evaluator(pool: Any, limit: float) -> Evaluate:
    """Give what runs trials in a pool of workers, each at most so long [s]."""

    def evaluate(trials: Sequence[Trial]) -> list[TrialRow]:
        futures = [
            pool.schedule(work, args=(trial, None, "none", None, ""), timeout=limit)
            for trial in trials
        ]
        return [row_of(future, trial, limit) for future, trial in zip(futures, trials, strict=True)]

    return evaluate


def while_time_is_left(evaluate: Evaluate, left: Callable[[], float]) -> Evaluate:
    """Give what skips trials once no time is left."""

    def evaluate_or_skip(trials: Sequence[Trial]) -> list[TrialRow]:
        if left() > 0:
            return evaluate(trials)
        reason = "no time was left of the budget"
        return [row_without_run(trial, Status.SKIPPED, reason) for trial in trials]

    return evaluate_or_skip
