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
    can = hasattr(signal, "SIGVTALRM") and threading.current_thread() is threading.main_thread()
    if not can or signal.getsignal(signal.SIGVTALRM) != signal.SIG_DFL:
        yield
        return

    def end(number: int, frame: FrameType | None) -> None:
        raise _OutOfTime

    signal.signal(signal.SIGVTALRM, end)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    except _OutOfTime:
        raise DikbenchError(f"{what} takes longer than {seconds:g} s of processor time") from None
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, signal.SIG_DFL)
