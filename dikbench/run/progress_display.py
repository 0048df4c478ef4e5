"""Progress of long work: a bar on a terminal, otherwise a line from time to time."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Final, Self

from tqdm import tqdm

SECONDS_BETWEEN_LINES: Final = 5.0


class ProgressDisplay:
    """Counts finished pieces of work; shows rate and time left."""

    def __init__(self, total: int, what: str) -> None:
        self._total = total
        self._what = what
        self._done = 0
        self._start = self._last = time.monotonic()
        self._bar = (
            tqdm(total=total, desc=what, unit=f" {what}", file=sys.stderr)
            if sys.stderr.isatty()
            else None
        )

    def __enter__(self) -> Self:
        """Return the display."""
        return self

    def advance(self, pieces: int = 1) -> None:
        """Count more finished pieces of work."""
        self._done += pieces
        if self._bar is not None:
            self._bar.update(pieces)
            return
        now = time.monotonic()
        if now - self._last >= SECONDS_BETWEEN_LINES or self._done == self._total:
            self._last = now
            rate = self._done / max(now - self._start, 1e-9)
            left = (self._total - self._done) / rate
            line = f"{self._what}: {self._done}/{self._total}, {rate:.1f}/s, {left:.0f} s left"
            print(line, file=sys.stderr, flush=True)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.close()
