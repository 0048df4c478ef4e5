"""The trials of a study in worker processes, which cannot harm each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass

from dikbench.results.folder import ResultsFolder
from dikbench.run.block_work import Block, BlockSettings, Executor
from dikbench.run.blocks import Engine, EngineChoice, blocks_of, smaller
from dikbench.run.on_this_machine import on_this_machine
from dikbench.run.shards import WHOLE, Shard
from dikbench.run.trial_row import TracePolicy, TrialRow, row_without_run
from dikbench.selector import Selector
from dikbench.simulation.status import Status
from dikbench.study.plan import PlannedTrial


@dataclass(frozen=True)
class RunSettings:
    """How a study is run.

    Attributes:
        jobs: number of worker processes.
        trial_timeout: wall-clock limit of a trial [s], enforced from outside its process.
        trial_memory: memory of a trial beyond that of its process at the start [MB].
        traces: which traces are kept.
        engine: whether trials of one kind run in lockstep or each alone (see `engine_of`).
        rerun: which finished trials are run again: "", "failed", "outdated" (made by other sources
            or versions), "all", or the selector (or the name) of a formulation, scenario or solver.
        metrics: metrics of other authors that are computed in addition.
        shard: the part of the study that is run.
        scheduler: address of the scheduler of a dask cluster, or its file, on whose workers trials
            run; empty: on this machine.
    """

    jobs: int
    trial_timeout: float = 120.0
    trial_memory: int = 4096
    traces: TracePolicy = "all"
    rerun: str = ""
    engine: EngineChoice = "auto"
    metrics: tuple[str, ...] = ()
    shard: Shard = WHOLE
    scheduler: str = ""


def run_trials(
    todo: Sequence[PlannedTrial],
    folder: ResultsFolder,
    settings: RunSettings,
    commit: str | None = None,
    command: str = "",
    engine: Engine = "alone",
) -> Iterator[list[tuple[PlannedTrial, TrialRow]]]:
    """Run trials in worker processes and yield rows when they are finished, together or singly.

    Raises:
        DikbenchError: if a trace cannot be written, or the cluster cannot be reached.
    """
    if skipped := [p for p in todo if p.skip]:
        yield [(p, row_without_run(p.trial, Status.SKIPPED, p.skip)) for p in skipped]
    # In the order of scenarios, so that a worker builds each once.
    first: dict[tuple[Selector, int], int] = {}
    for p in todo:
        first.setdefault((p.trial.scenario, p.trial.seed), len(first))
    ordered = sorted(
        (p for p in todo if not p.skip), key=lambda p: first[p.trial.scenario, p.trial.seed]
    )
    blocks = [[p] for p in ordered] if engine == "alone" else blocks_of(ordered, settings.jobs)
    if not blocks:
        return
    how = BlockSettings(
        engine,
        settings.trial_timeout,
        settings.trial_memory,
        settings.traces,
        commit,
        command,
        settings.metrics,
    )
    with _executor(settings, folder, how) as executor:
        yield from _run_blocks(deque(blocks), executor)


def _executor(
    settings: RunSettings, folder: ResultsFolder, how: BlockSettings
) -> AbstractContextManager[Executor]:
    if settings.scheduler:
        from dikbench.run.on_dask import on_dask

        return on_dask(settings.scheduler, folder, how)
    return on_this_machine(settings.jobs, folder, how)


def _run_blocks(
    waiting: deque[Block], executor: Executor
) -> Iterator[list[tuple[PlannedTrial, TrialRow]]]:
    """Run blocks of trials; what kills its worker is run in smaller ones."""
    while waiting or executor.is_busy():
        while waiting and executor.has_room():
            executor.give(waiting.popleft())
        done: list[tuple[PlannedTrial, TrialRow]] = []
        for block, rows in executor.finished():
            if rows is None:
                waiting.extendleft(smaller(block))
            else:
                done += zip(block, rows, strict=True)
        if done:
            yield done  # in one transaction, which costs more than a row
