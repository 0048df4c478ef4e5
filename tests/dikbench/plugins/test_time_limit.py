"""Code of a plug-in that does not end is ended."""

from __future__ import annotations

import signal
import threading

import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins.time_limit import others_may_run, time_limit


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


def outer() -> None:
    """Let others run for longer than is left, then take the rest."""
    with time_limit(0.1, "the outer"):
        with others_may_run():
            inner()
        endless()


def inner() -> None:
    """Run into a limit of its own."""
    with (
        pytest.raises(DikbenchError, match=r"^the inner takes longer"),
        time_limit(0.3, "the inner"),
    ):
        endless()


def test_the_time_of_others_does_not_count() -> None:
    """They may have a limit of their own; afterwards the first one counts on."""
    with pytest.raises(DikbenchError, match=r"^the outer takes longer"):
        outer()
    assert signal.getsignal(signal.SIGVTALRM) == signal.SIG_DFL
    with others_may_run():  # without a limit around it
        assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0.0, 0.0)
