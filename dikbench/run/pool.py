"""Worker processes, which cannot harm each other or the driver."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Final

from pebble import ProcessPool

from dikbench.run.worker_process import prepare

THREAD_VARIABLES: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


@contextmanager
def workers(
    count: int, imports: tuple[str, ...] = (), memory: int | None = None
) -> Iterator[ProcessPool]:
    """Start persistent worker processes, each limited to one thread before it imports anything.

    Args:
        count: number of processes.
        imports: modules that each imports at its start.
        memory: limit of its memory beyond that at its start [MB], if the system has limits.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    main = sys.modules["__main__"]
    # A new process would import the script that was started and, without a guard
    # `if __name__ == "__main__"` in it, run the study as well.
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    pool = ProcessPool(
        max_workers=count,
        context=multiprocessing.get_context("spawn"),
        initializer=prepare,
        initargs=(imports, memory),
    )
    try:
        yield pool
        pool.close()
    except BaseException:
        pool.stop()
        raise
    finally:
        pool.join()
        sys.modules["__main__"] = main
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def available_cores() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def end_group(process: int) -> None:
    """Kill the process group of a worker."""
    if hasattr(os, "killpg"):
        try:
            os.killpg(process, signal.SIGKILL)
        except (ProcessLookupError, PermissionError):
            pass
