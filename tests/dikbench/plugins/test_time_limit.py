"""Code of a plug-in that does not end is ended."""

from __future__ import annotations

import signal
import threading

import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.time_limit import time_limit


def endless() -> None:
    """Catch every error, as a family that searches does."""
    while True:
        try:
            sum(range(1000))
        except Exception:
            continue


def test_an_endless_loop_is_one_line() -> None:
    """It names what took so long; the process is as it was before."""
    with (
        pytest.raises(DikbenchError, match=r"^its building takes longer than 0\.1 s"),
        time_limit(0.1, "its building"),
    ):
        endless()
    assert signal.getsignal(signal.SIGVTALRM) == signal.SIG_DFL
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0.0, 0.0)


def test_what_ends_in_time_is_left_alone() -> None:
    """Also where one limit is inside of another, and in a thread, where there is none."""
    with time_limit(100.0, "the outer"), time_limit(1e-9, "the inner"):
        sum(range(100_000))
    done = []

    def work() -> None:
        with time_limit(1e-9, "a thread"):
            done.append(sum(range(100_000)))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done
