"""How a block of trials is run in a pool of worker processes, and the rows that come of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from pebble import ProcessExpired

from dikbench.run.blocks import Engine, block_timeout
from dikbench.run.same_as_driver import Expected, OtherWorker, as_expected
from dikbench.run.trial_row import CannotStore, TracePolicy, TrialRow, row_without_run, work
from dikbench.run.trials_together import work_together
from dikbench.simulation.status import Status
from dikbench.study.plan import PlannedTrial
from dikbench.study.trial import Trial

Block = list[PlannedTrial]

Finished = tuple[Block, list[TrialRow] | None]
"""A block and its rows; None where one of several trials ended its worker."""

WORK: Final = (work.__module__, work_together.__module__, as_expected.__module__)
"""Modules that each worker imports at its start."""


class Pool(Protocol):
    """What is asked of a pool of worker processes."""

    def schedule(
        self, function: Callable[..., Any], args: tuple[Any, ...] = (), timeout: float | None = None
    ) -> Future[Any]:
        """Have a worker call a function."""
        ...


class Executor(Protocol):
    """Where blocks of trials run."""

    def has_room(self) -> bool:
        """Say whether another block should be given."""
        ...

    def give(self, block: Block) -> None:
        """Have a block run."""
        ...

    def is_busy(self) -> bool:
        """Say whether blocks were given that are not finished."""
        ...

    def finished(self) -> list[Finished]:
        """Wait for blocks to be finished, and return them; there may be none yet."""
        ...


@dataclass(frozen=True)
class BlockSettings:
    """How each block of a run is run.

    Attributes:
        engine: whether trials of one kind run in lockstep or each alone.
        timeout: wall-clock limit of a trial [s].
        memory: memory of a trial beyond that of its process at the start [MB].
        traces: which traces are kept.
        commit, command: see `environment`.
        metrics: metrics of other authors that are computed in addition.
    """

    engine: Engine
    timeout: float
    memory: int
    traces: TracePolicy
    commit: str | None
    command: str
    metrics: tuple[str, ...]


def schedule(
    pool: Pool,
    block: Block,
    traces: Sequence[Path],
    how: BlockSettings,
    expected: Expected | None = None,
) -> Future[Any]:
    """Hand a block to a pool.

    Args:
        pool: of worker processes.
        block: the trials.
        traces: a file for the trace of each.
        how: how they are run.
        expected: what the worker must have to run them; None: anything.
    """
    given = how.traces, how.commit, how.command, how.metrics
    timeout = how.timeout
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    if how.engine == "alone":
        [p], [trace] = block, traces
        function, arguments = work, (p.trial, trace, *given)
    else:  # of one trial, too: its numbers are then those beside others
        arguments = ([p.trial for p in block], traces, *given)
        function, timeout = work_together, block_timeout(len(block), timeout)
    if expected is not None:
        trials = [p.trial for p in block]
        function, arguments = as_expected, (expected, trials, how.metrics, function, *arguments)
    return pool.schedule(function, args=arguments, timeout=timeout)


def rows_of_block(future: Future[Any], block: Block, timeout: float) -> list[TrialRow] | None:
    """Return the rows of a finished block; None where one of several trials ended its worker.

    Raises:
        CannotStore: if a trace cannot be written.
        OtherWorker: if the worker lacks what was expected of it.
    """
    if len(block) == 1:
        return [row_of(future, block[0].trial, timeout)]
    try:
        rows, described = future.result()
    except (CannotStore, OtherWorker):
        raise
    except Exception:
        return None
    return [{**row, "described": described} for row in rows]


def row_of(future: Future[Any], trial: Trial, timeout: float) -> TrialRow:
    """Return the row of a finished trial, however it ended."""
    try:
        made, described = future.result()
    except (CannotStore, OtherWorker):
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
