"""What a worker of a dask cluster does with a block of trials: it runs in worker processes of ours.

Time and memory of a trial are limited there as on one machine, and a trial that ends its process
does not end the worker.
"""

from __future__ import annotations

import atexit
import tempfile
import threading
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing import active_children, current_process
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True)
class Answer:
    """What came of a block.

    Attributes:
        rows: see `rows_of_block`.
        traces: the files of the traces that are kept, by the ids of their trials.
        refused: why the worker may not run it; an empty text where it did.
    """

    rows: list[TrialRow] | None
    traces: dict[str, bytes]
    refused: str = ""


@dataclass(frozen=True)
class _Processes:
    """The worker processes that a run has on this worker, and a folder for their traces."""

    run: str
    pool: Pool
    folder: Path
    closing: ExitStack


_LOCK = threading.Lock()
_CURRENT: list[_Processes] = []


def run_block(run: str, block: Block, how: BlockSettings, expected: Expected) -> Answer:
    """Run a block of trials.

    Args:
        run: a name of the run; a new one starts new processes, which read files anew.
        block: the trials.
        how: how they are run.
        expected: what must be the same here as on the driver.

    Raises:
        CannotStore: if a trace cannot be written.
    """
    processes = _processes(run, how.memory)
    files = [processes.folder / f"{p.id}.arrow" for p in block]
    try:
        future = schedule(processes.pool, block, files, how, expected)
        rows = rows_of_block(future, block, how.timeout)
        kept = {p.id: f.read_bytes() for p, f in zip(block, files, strict=True) if f.is_file()}
    except OtherWorker as error:
        return Answer(None, {}, str(error))
    finally:
        for file in files:
            file.unlink(missing_ok=True)
    return Answer(rows, kept)


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
