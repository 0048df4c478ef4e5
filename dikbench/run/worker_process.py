"""A worker process: what it does with itself before and after a trial."""

from __future__ import annotations

import ctypes
import gc
import os
import random
import signal
import sys
from importlib import import_module
from typing import Any, Final

import numpy as np

if sys.platform != "win32":
    import resource

EXITED: Final = 70
"""Exit code of a worker in which a plug-in called `os._exit(0)`: an exit code of 0 would be an
orderly end to the pool, which would wait for the answer."""

PARENT_DEATH_SIGNAL: Final = 1
"""PR_SET_PDEATHSIG of Linux' prctl."""

CALM: dict[str, Any] = {}
"""State of a worker process as it was before any trial: what a plug-in may have changed of it is
put back."""


def prepare(imports: tuple[str, ...], memory: int | None) -> None:
    """Make a new process a worker: imports done, out of the terminal's reach, memory limited.

    Args:
        imports: modules that are loaded before the limit: their memory is not the trial's.
        memory: what the process may take beyond that [MB], where the system can limit it.
    """
    _die_with_the_driver()
    for module in imports:
        import_module(module)
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)  # what a plug-in forks can be found and ended, and Ctrl-C is the driver's
    _silence()
    leave = os._exit
    own = os.getpid()

    def leave_loudly(code: int) -> Any:
        leave(code or (EXITED if os.getpid() == own else 0))

    os._exit = leave_loudly  # type: ignore[assignment]
    CALM.update(folder=os.getcwd(), errors=np.geterr(), process=own, leave=leave)
    gc.collect()
    gc.freeze()  # what is imported stays: the collector need not look at it after every few trials
    if memory is not None and sys.platform != "win32":
        limit = _address_space() + memory * 2**20
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def calm_down() -> None:
    """Put back what a plug-in may have changed of this process, and leave a forked copy of it."""
    if not CALM:  # not a worker
        return
    if os.getpid() != CALM["process"]:
        CALM["leave"](0)
    os.chdir(CALM["folder"])
    np.seterr(**CALM["errors"])
    np.random.seed(0)  # noqa: NPY002 - a plug-in may draw from it, and every trial starts alike
    random.seed(0)


def _die_with_the_driver() -> None:
    """Have Linux kill this process when the driver dies: a formulation may loop for ever."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PARENT_DEATH_SIGNAL, signal.SIGKILL)


def _silence() -> None:
    """Discard what plug-ins and solvers print: megabytes would drown the run."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    os.close(nowhere)


def _address_space() -> int:
    """Return the bytes of address space that this process has now."""
    try:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[0]) * resource.getpagesize()
    except OSError:  # not Linux: the limit is then absolute
        return 0
