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


class BudgetDisplay:
    """Shows the share of a budget that is spent, and what is done: a bar, or a line every 5 s."""

    def __init__(self, budget: str) -> None:
        self._budget = budget
        self._last = -SECONDS_BETWEEN_LINES
        self._bar = (
            tqdm(total=100, desc=f"of {budget}", unit="%", bar_format="{l_bar}{bar}| {postfix}")
            if sys.stderr.isatty()
            else None
        )

    def __enter__(self) -> Self:
        """Return the display."""
        return self

    def tell(self, spent: float, what: str) -> None:
        """Tell what is done, and the share of the budget, 0 to 1, that is spent."""
        if self._bar is not None:
            self._bar.n = min(100, round(100 * spent))
            self._bar.set_postfix_str(what)
            return
        now = time.monotonic()
        if now - self._last >= SECONDS_BETWEEN_LINES:
            self._last = now
            print(f"{100 * spent:3.0f} % of {self._budget}: {what}", file=sys.stderr, flush=True)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.close()
