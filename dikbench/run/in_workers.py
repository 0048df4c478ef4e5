"""The trials of a study in worker processes, which cannot harm each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from multiprocessing import active_children
from typing import Any, Final

from pebble import ProcessExpired

from dikbench.results.folder import ResultsFolder
from dikbench.run.blocks import Engine, EngineChoice, block_timeout, blocks_of, smaller
from dikbench.run.pool import end_group, workers
from dikbench.run.trial_row import CannotStore, TracePolicy, TrialRow, row_without_run, work
from dikbench.run.trials_together import work_together
from dikbench.selector import Selector
from dikbench.simulation.status import Status
from dikbench.study.plan import PlannedTrial
from dikbench.study.trial import Trial

TRIALS_HANDED_AHEAD_PER_WORKER: Final = 8
"""So many that no worker waits, and few enough that memory does not grow."""

WORK: Final = (work.__module__, work_together.__module__)
"""Modules that each worker imports at its start."""


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
    """

    jobs: int
    trial_timeout: float = 120.0
    trial_memory: int = 4096
    traces: TracePolicy = "all"
    rerun: str = ""
    engine: EngineChoice = "auto"
    metrics: tuple[str, ...] = ()


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
        DikbenchError: if a trace cannot be written.
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
    yield from _run_blocks(deque(blocks), folder, settings, commit, command, engine)


def _run_blocks(
    waiting: deque[list[PlannedTrial]],
    folder: ResultsFolder,
    settings: RunSettings,
    commit: str | None,
    command: str,
    engine: Engine,
) -> Iterator[list[tuple[PlannedTrial, TrialRow]]]:
    """Run blocks of trials in worker processes; what kills its worker is run in smaller ones."""
    most = TRIALS_HANDED_AHEAD_PER_WORKER * settings.jobs
    given = settings.traces, commit, command, settings.metrics
    processes: set[int] = set()
    try:
        with workers(settings.jobs, WORK, settings.trial_memory) as pool:
            running: dict[Future[Any], list[PlannedTrial]] = {}
            while True:
                while waiting and len(running) < most:
                    block = waiting.popleft()
                    traces = [folder.trace(p.id) for p in block]
                    timeout = settings.trial_timeout
                    if engine == "alone":
                        arguments: tuple[Any, ...] = (block[0].trial, traces[0], *given)
                        function: Callable[..., Any] = work
                    else:  # of one trial, too: its numbers are then those beside others
                        arguments = ([p.trial for p in block], traces, *given)
                        function = work_together
                        timeout = block_timeout(len(block), timeout)
                    future = pool.schedule(function, args=arguments, timeout=timeout)
                    running[future] = block
                if not running:
                    return
                processes.update(child.pid for child in active_children() if child.pid)
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    block = running.pop(future)
                    if len(block) == 1:
                        yield [(block[0], row_of(future, block[0].trial, settings.trial_timeout))]
                    elif (rows := _rows(future)) is None:
                        waiting.extendleft(smaller(block))
                    else:
                        yield [*zip(block, rows, strict=True)]
    finally:
        for process in processes:
            end_group(process)


def _rows(future: Future[Any]) -> list[TrialRow] | None:
    """Return the rows of a finished block; None where one of its trials ended its worker."""
    try:
        rows, described = future.result()
    except CannotStore:
        raise
    except Exception:
        return None
    return [{**row, "described": described} for row in rows]


def row_of(future: Future[Any], trial: Trial, timeout: float) -> TrialRow:
    """Return the row of a finished trial, however it ended."""
    try:
        made, described = future.result()
    except CannotStore:
        raise
    except TimeoutError:
        return row_without_run(trial, Status.TIMEOUT, f"not finished after {timeout:g} s")
    except ProcessExpired as error:
        reason = f"the worker ended with exit code {error.exitcode}"
        return row_without_run(trial, Status.CRASHED, reason)
    except MemoryError:
        return row_without_run(trial, Status.OUT_OF_MEMORY, "out of memory")
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".partition("\n")[0]
        return row_without_run(trial, Status.FORMULATION_ERROR, reason)
    [row] = made if isinstance(made, list) else [made]
    return {**row, "described": described}
