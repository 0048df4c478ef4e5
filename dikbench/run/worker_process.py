"""A worker process: its preparation, and its restoration after a trial."""

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

EXIT_CODE_OF_PLUGIN_EXIT: Final = 70
"""Exit code of a worker in which a plug-in called `os._exit(0)`; with 0 the pool would wait for an
answer."""

PARENT_DEATH_SIGNAL: Final = 1
"""PR_SET_PDEATHSIG of Linux' prctl."""

STATE_BEFORE_TRIALS: dict[str, Any] = {}
"""State of a worker process before any trial, which is restored after each."""


def prepare(imports: tuple[str, ...], memory: int | None) -> None:
    """Make a new process a worker: imports done, out of the terminal's reach, memory limited.

    Args:
        imports: modules to load before the limit is set.
        memory: limit of the memory beyond that [MB], if the system has limits.
    """
    _die_with_the_driver()
    for module in imports:
        import_module(module)
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)  # for ending what a plug-in forks; Ctrl-C reaches the driver only
    _silence()
    leave = os._exit
    own = os.getpid()

    def leave_loudly(code: int) -> Any:
        leave(code or (EXIT_CODE_OF_PLUGIN_EXIT if os.getpid() == own else 0))

    os._exit = leave_loudly  # type: ignore[assignment]
    STATE_BEFORE_TRIALS.update(folder=os.getcwd(), errors=np.geterr(), process=own, leave=leave)
    gc.collect()
    gc.freeze()  # imported modules stay, so that the collector need not scan them
    if memory is not None and sys.platform != "win32":
        limit = _address_space() + memory * 2**20
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def restore_process() -> None:
    """Restore what a plug-in may have changed of this process; end a forked copy of it."""
    if not STATE_BEFORE_TRIALS:  # not a worker
        return
    if os.getpid() != STATE_BEFORE_TRIALS["process"]:
        STATE_BEFORE_TRIALS["leave"](0)
    os.chdir(STATE_BEFORE_TRIALS["folder"])
    np.seterr(**STATE_BEFORE_TRIALS["errors"])
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
