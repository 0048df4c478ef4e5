"""Trials that a search asks for, in worker processes that stay for all of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from dikbench.run.in_workers import WORK, RunSettings, row_of
from dikbench.run.pool import workers
from dikbench.run.trial_row import TrialRow, work
from dikbench.study.trial import Trial

Evaluate = Callable[[Sequence[Trial]], Sequence[TrialRow]]
"""Runs trials and gives their rows in their order."""


@contextmanager
def in_workers(settings: RunSettings) -> Iterator[Evaluate]:
    """Give what runs trials, each alone as `dikbench run` runs a single one; no trace is kept."""
    with workers(settings.jobs, WORK, settings.trial_memory) as pool:

        def evaluate(trials: Sequence[Trial]) -> list[TrialRow]:
            limit = settings.trial_timeout
            futures = [
                pool.schedule(work, args=(trial, None, "none", None, ""), timeout=limit)
                for trial in trials
            ]
            return [
                row_of(future, trial, limit) for future, trial in zip(futures, trials, strict=True)
            ]

        yield evaluate
