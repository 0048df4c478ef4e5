"""What a worker of a dask cluster does with blocks of trials: they run in processes of our own.

Time and memory of a trial are limited there as on one machine, and a trial that ends its process
does not end the worker.
"""

from __future__ import annotations

import atexit
import tempfile
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import dataclass, replace
from multiprocessing import active_children, current_process
from pathlib import Path
from typing import Any, Final

from distributed import get_worker

from dikbench.run.block_work import (
    WORK,
    Block,
    BlockSettings,
    Pool,
    rows_of_block,
    schedule,
)
from dikbench.run.pool import end_group, workers
from dikbench.run.same_as_driver import Expected, OtherWorker
from dikbench.run.trial_row import TrialRow

Made = tuple[list[TrialRow] | None, dict[str, bytes]]
"""The rows of a block (see `rows_of_block`), and the files of the traces that are kept, by the ids
of their trials."""


@dataclass(frozen=True)
class Answer:
    """What came of some blocks.

    Attributes:
        made: of each block what came of it; None where there was no time for it.
        refused: why the worker may not run them; an empty text where it may.
    """

    made: list[Made | None]
    refused: str = ""


SECONDS_TOGETHER: Final = 5.0
"""After so long no other block is begun, so that rows come back, and nobody waits for the last."""

AT_A_TIME: Final = 2
"""One that runs and one that waits, so that no process does."""


@dataclass(frozen=True)
class _Processes:
    """The worker processes that a run has on this worker, and a folder for their traces."""

    run: str
    pool: Pool
    folder: Path
    closing: ExitStack


_LOCK = threading.Lock()
_CURRENT: list[_Processes] = []


def run_blocks(
    run: str,
    blocks: list[Block],
    how: BlockSettings,
    expected: Expected,
    sources: list[Mapping[str, str]],
) -> Answer:
    """Run blocks of trials one after the other, as many as there is time for.

    Args:
        run: a name of the run; a new one starts new processes, which read files anew.
        blocks: the trials.
        how: how they are run.
        expected: what must be the same here as on the driver, without sources.
        sources: those of each block.

    Raises:
        CannotStore: if a trace cannot be written.
    """
    processes = _processes(run, how.memory)
    made: list[Made | None] = [None] * len(blocks)
    begun: deque[tuple[int, Future[Any], list[Path]]] = deque()
    waiting, deadline = deque(range(len(blocks))), time.monotonic() + SECONDS_TOGETHER
    try:
        while waiting or begun:
            while waiting and len(begun) < AT_A_TIME:
                number = waiting.popleft()
                files = [processes.folder / f"{p.id}.arrow" for p in blocks[number]]
                wanted = replace(expected, sources=sources[number])
                future = schedule(processes.pool, blocks[number], files, how, wanted)
                begun.append((number, future, files))
            number, future, files = begun.popleft()
            made[number] = _made(future, blocks[number], files, how.timeout)
            if time.monotonic() > deadline:
                waiting.clear()
    except OtherWorker as error:
        return Answer([None] * len(blocks), str(error))
    return Answer(made)


def _made(future: Future[Any], block: Block, files: Sequence[Path], timeout: float) -> Made:
    """Wait for a block, and take its traces."""
    try:
        rows = rows_of_block(future, block, timeout)
        kept = {p.id: f.read_bytes() for p, f in zip(block, files, strict=True) if f.is_file()}
    finally:
        for file in files:
            file.unlink(missing_ok=True)
    return rows, kept


def release(run: str) -> None:
    """End the processes of a run, whatever they do."""
    with _LOCK:
        if _CURRENT and _CURRENT[0].run == run:
            _end_processes()


def _processes(run: str, memory: int) -> _Processes:
    with _LOCK:
        if _CURRENT and _CURRENT[0].run != run:
            _end_processes()
        if not _CURRENT:
            # A nanny's worker may have no children, lest they outlive it; ours end with it.
            configuration: Any = vars(current_process())["_config"]
            configuration["daemon"] = False
            closing = ExitStack()
            folder = Path(closing.enter_context(tempfile.TemporaryDirectory(prefix="dikbench-")))
            pool = closing.enter_context(workers(get_worker().state.nthreads, WORK, memory))
            closing.callback(_end_groups)
            closing.callback(pool.stop)
            _CURRENT.append(_Processes(run, pool, folder, closing))
        return _CURRENT[0]


def _end_groups() -> None:
    for child in active_children():
        if child.pid:
            end_group(child.pid)


@atexit.register
def _end_processes() -> None:
    while _CURRENT:
        _CURRENT.pop().closing.close()
