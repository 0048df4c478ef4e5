"""The `solve` of a formulation that is asked for many control steps at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.guessed import Guess, guessed
from dikbench.solvers.recheck.rechecked import RecheckedSteps, Solved

DIMENSIONS: Final = {"P": 2, "q": 1, "G": 2, "h": 1, "A": 2, "b": 1, "lb": 1, "ub": 1}
"""The parts of a program and their dimensions in one row."""


class ManySolve:
    """Solves the programs of N control steps, posed at once, row by row.

    A row whose minimiser keeps every bound without being asked to (see `guessed`) has that for an
    answer, where `guesses` is set; the others are handed to the solver of their trial. A row
    without an answer is NaN. All answers are rechecked.

    Attributes:
        rechecked: of the current control step, a row each; None where nothing was solved.
    """

    __slots__ = ("_guesses", "_site", "_solves", "rechecked")

    rechecked: RecheckedSteps | None

    def __init__(self, *, guesses: bool) -> None:
        self._guesses = guesses
        self.begin_step([])

    def begin_step(self, solves: Sequence[CheckedSolve]) -> None:
        """Begin a control step of trials with these solvers, one per row."""
        self._solves, self._site, self.rechecked = solves, 0, None

    def __call__(self, program: QuadraticProgram | ModelledProgram) -> Array:
        """Solve N programs; each part is that of all rows, or has a row each.

        Returns:
            (N, n); NaN in rows without an answer.
        """
        assert isinstance(program, QuadraticProgram)
        count = len(self._solves)
        guess = guessed(program, count) if self._guesses else None
        if guess is None:
            x, open_ = np.full((count, program.q.shape[-1]), np.nan), [*range(count)]
        else:
            self._record(guess)
            x = np.where(guess.minimal[:, None], guess.x, np.nan)
            open_ = np.flatnonzero(~guess.minimal).tolist()
        solved: list[Solved] = []
        for k in open_:
            row = _row(program, k)
            answer = self._solves[k].answer(row, self._site)
            solved.append((k, row, answer))
            if answer.claimed and answer.x is not None:
                x[k] = answer.x
        if solved:
            self._records().recheck(solved, self._solves[0].tolerance)
        self._site += 1
        return x

    def verify(
        self,
        program: QuadraticProgram,
        x: Array,
        y: Array | None = None,
        z: Array | None = None,
        z_box: Array | None = None,
    ) -> None:
        """Recheck what the formulation solved itself, rows without an answer left out.

        Each part of the program and of the answer has a row each (see `Solve.verify`).
        """
        solved: list[Solved] = []
        for k in np.flatnonzero(np.isfinite(x).all(axis=1)).tolist():
            own = {"y": y, "z": z, "z_box": z_box}
            parts: dict[str, Any] = {n: None if p is None else p[k] for n, p in own.items()}
            solved.append((k, _row(program, k), Answer(x[k], claimed=True, **parts)))
        if solved:
            self._records().recheck(solved, self._solves[0].tolerance)

    def _records(self) -> RecheckedSteps:
        if self.rechecked is None:
            self.rechecked = RecheckedSteps(len(self._solves))
        return self.rechecked

    def _record(self, guess: Guess) -> None:
        """Record the rows that need no solver."""
        kept, steps = guess.minimal, self._records()
        for record, worst in (
            (steps.primal, guess.primal),
            (steps.dual, guess.dual),
            (steps.gap, guess.gap),
            (steps.distance, guess.distance),
        ):
            record[kept] = np.maximum(record[kept], worst[kept])
        for flags in (steps.claimed, steps.verified):
            flags[kept] = np.abs(flags[kept])


def _row(program: QuadraticProgram, k: int) -> QuadraticProgram:
    """Return the program of one row."""
    parts: dict[str, Any] = {}
    for name, dimensions in DIMENSIONS.items():
        part = getattr(program, name)
        parts[name] = part[k] if part is not None and part.ndim > dimensions else part
    return QuadraticProgram(**parts)
