"""Capture what a C++ library writes to standard error."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def captured_stderr() -> Iterator[Callable[[], str]]:
    """Redirect file descriptor 2; yield a function that reads what was written so far."""
    before = os.dup(2)
    with tempfile.TemporaryFile() as file:
        os.dup2(file.fileno(), 2)
        try:
            yield lambda: _text(file.fileno())
        finally:
            os.dup2(before, 2)
            os.close(before)


def _text(descriptor: int) -> str:
    return os.pread(descriptor, 10_000, 0).decode(errors="replace")
