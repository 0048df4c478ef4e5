"""Blocks of trials in worker processes of this machine."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from multiprocessing import active_children
from typing import Any, Final

from dikbench.results.folder import ResultsFolder
from dikbench.run.block_work import (
    WORK,
    Block,
    BlockSettings,
    Finished,
    Pool,
    rows_of_block,
    schedule,
)
from dikbench.run.pool import end_group, workers

BLOCKS_HANDED_AHEAD_PER_WORKER: Final = 8
"""So many that no worker waits, and few enough that memory does not grow."""


class OnThisMachine:
    """An executor of a pool of worker processes.

    Args:
        pool: the pool.
        jobs: number of its processes.
        folder: where traces are kept.
        how: how blocks are run.

    Attributes:
        processes: the ids of all processes that the pool has had.
    """

    def __init__(self, pool: Pool, jobs: int, folder: ResultsFolder, how: BlockSettings) -> None:
        self._pool = pool
        self._most = BLOCKS_HANDED_AHEAD_PER_WORKER * jobs
        self._folder = folder
        self._how = how
        self._running: dict[Future[Any], Block] = {}
        self.processes: set[int] = set()

    def has_room(self) -> bool:
        """Say whether another block should be given."""
        return len(self._running) < self._most

    def give(self, block: Block) -> None:
        """Have a block run."""
        traces = [self._folder.trace(p.id) for p in block]
        self._running[schedule(self._pool, block, traces, self._how)] = block

    def is_busy(self) -> bool:
        """Say whether blocks were given that are not finished."""
        return bool(self._running)

    def finished(self) -> list[Finished]:
        """Wait for blocks to be finished, and return them.

        Raises:
            CannotStore: if a trace cannot be written.
        """
        self.processes.update(child.pid for child in active_children() if child.pid)
        found = []
        for future in wait(self._running, return_when=FIRST_COMPLETED).done:
            block = self._running.pop(future)
            found.append((block, rows_of_block(future, block, self._how.timeout)))
        return found


@contextmanager
def on_this_machine(
    jobs: int, folder: ResultsFolder, how: BlockSettings
) -> Iterator[OnThisMachine]:
    """Start worker processes; what plug-ins forked ends with them."""
    executor = None
    try:
        with workers(jobs, WORK, how.memory) as pool:
            executor = OnThisMachine(pool, jobs, folder, how)
            yield executor
    finally:
        for process in () if executor is None else executor.processes:
            end_group(process)
