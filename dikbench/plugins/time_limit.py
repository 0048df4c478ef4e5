"""A limit of the processor time that code of a plug-in may take."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from dikbench.errors import DikbenchError


class _OutOfTime(BaseException):
    """Ends code that catches every Exception."""


@contextmanager
def time_limit(seconds: float, what: str) -> Iterator[None]:
    """End the block after some seconds of this process's processor time.

    Where that cannot be (not in the main thread, on Windows, or inside another such block) there is
    no limit.

    Args:
        seconds: the limit [s].
        what: the subject of the error's sentence.

    Raises:
        DikbenchError: if the time is over.
    """
    if _handler() != signal.SIG_DFL:
        yield
        return
    _start(seconds)
    try:
        yield
    except _OutOfTime:
        raise DikbenchError(f"{what} takes longer than {seconds:g} s of processor time") from None
    finally:
        _stop()


@contextmanager
def others_may_run() -> Iterator[None]:
    """Stop the clock of the block around this one, if there is a limit, and start it again after.

    What runs meanwhile may have a limit of its own.
    """
    if _handler() is not _end:
        yield
        return
    left = _stop()
    try:
        yield
    finally:
        _start(left)


def _handler() -> object:
    """Return what is done when time is over; None where there cannot be a limit."""
    can = hasattr(signal, "SIGVTALRM") and threading.current_thread() is threading.main_thread()
    return signal.getsignal(signal.SIGVTALRM) if can else None


def _start(seconds: float) -> None:
    signal.signal(signal.SIGVTALRM, _end)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)


def _stop() -> float:
    """Stop the clock and return the time that was left [s]."""
    left, _ = signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    signal.signal(signal.SIGVTALRM, signal.SIG_DFL)
    return left


def _end(number: int, frame: FrameType | None) -> None:
    raise _OutOfTime
