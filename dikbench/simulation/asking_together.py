"""A formulation asked for many control steps at once, and for a row alone where that fails."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.problem.problem import DikProblem, Formulation, is_batched, program_of
from dikbench.robots.limits import Limits
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.many_solve import ManySolve
from dikbench.solvers.recheck.rechecked import RecheckedSteps


class AskedTogether:
    """A formulation and the trials that it answers, which are neighbours among all rows.

    Attributes:
        formulation: the formulation.
        rows: where its trials are among all that are running.
        solves: their solvers.
        rechecked: what was solved for them together at this step; None where nothing was.
    """

    def __init__(
        self,
        formulation: Formulation,
        first: int,
        solves: Sequence[CheckedSolve],
        *,
        guesses: bool,
    ) -> None:
        self.formulation = formulation
        self.rows = slice(first, first + len(solves))
        self.solves = [*solves]
        self.rechecked: RecheckedSteps | None = None
        self._batched = is_batched(formulation)
        self._many = ManySolve(guesses=guesses and program_of(formulation) is not None)

    def keep(self, kept: Mask, first: int) -> None:
        """Go on with some of the trials, the first of them in the row `first`."""
        own = np.flatnonzero(kept[self.rows]).tolist()
        self.solves = [self.solves[row] for row in own]
        self.rows = slice(first, first + len(own))

    def ask(self, problem: DikProblem) -> tuple[Array, Mask]:
        """Ask for all its rows at once.

        Where that raises, each row is asked for as one of one, which has the same answer to the
        bit.

        Args:
            problem: the problems of its rows.

        Returns:
            Velocities (n, nv), and which rows have to be asked alone, (n,); `relaxed` of the
            problem is recorded.
        """
        shape = len(self.solves), problem.robot.nv
        self.rechecked = None
        if not self._batched:
            return np.full(shape, np.nan), np.ones(len(self.solves), dtype=bool)
        finite = _finite_rows(problem)
        own = part_of(problem, slice(None))  # a formulation may change what it is handed
        v = self._together(own, self.solves)
        if v is not None:
            problem.relaxed = own.relaxed
            self.rechecked = self._many.rechecked
            return v, _unanswered(v) | ~finite
        v, records = np.full(shape, np.nan), RecheckedSteps(len(self.solves))
        relaxed = np.zeros(len(self.solves), dtype=int)
        for row in np.flatnonzero(finite).tolist():
            own = part_of(problem, slice(row, row + 1))
            one = self._together(own, self.solves[row : row + 1])
            if one is not None:
                v[row], relaxed[row] = one[0], np.ravel(own.relaxed)[0]
                if self._many.rechecked is not None:
                    _copy(self._many.rechecked, records, row)
                    self.rechecked = records
        problem.relaxed = relaxed
        return v, _unanswered(v)

    def _together(self, problem: DikProblem, solves: Sequence[CheckedSolve]) -> Array | None:
        """Ask for rows at once; None where that raises or is no array of velocities."""
        self._many.begin_step(solves)
        try:
            with np.errstate():  # what it sets is not for others
                answer: Any = self.formulation.velocity(problem, self._many)
        except MemoryError:
            raise
        except Exception:
            return None
        shape = len(solves), problem.robot.nv
        fits = type(answer) is np.ndarray and answer.shape == shape and answer.dtype == float
        counted = np.shape(problem.relaxed) in ((), (len(solves),))
        return (
            answer if fits and counted and np.asarray(problem.relaxed).dtype.kind == "i" else None
        )


def part_of(problem: DikProblem, rows: slice) -> DikProblem:
    """Return neighbouring rows of problems posed at once, read-only."""
    tasks = []
    for task in problem.tasks:
        J = task.J if task.J.ndim == 2 else task.J[rows]
        part = type(task)(J, task.V[rows], task.error[rows], task.weight, task.priority)
        tasks.append(part)
    coordinates, v_prev = problem.limits.coordinates, problem.v_prev
    limits = Limits(problem.limits.joint, None if coordinates is None else coordinates[rows])
    before = None if v_prev is None else v_prev[rows]
    return DikProblem(problem.robot, problem.q[rows], before, problem.dt, tasks, limits)


def _finite_rows(problem: DikProblem) -> Mask:
    """Say which rows hold numbers alone, (n,): a sum of squares tells almost always."""
    parts = [problem.q, *(x for task in problem.tasks for x in (task.V, task.error))]
    parts += [task.J.reshape(len(task.J), -1) for task in problem.tasks if task.J.ndim == 3]
    if problem.v_prev is not None:
        parts.append(problem.v_prev)
    with np.errstate(over="ignore", invalid="ignore"):
        finite: Mask = np.isfinite(sum(np.vecdot(part, part) for part in parts))
    if not finite.all():  # the squares may overflow
        finite = np.logical_and.reduce([np.isfinite(part).all(axis=1) for part in parts])
    return finite


def _unanswered(v: Array) -> Mask:
    """Say which rows of velocities (n, nv) are no answers, (n,)."""
    unanswered: Mask = np.logical_not(np.isfinite(v).all(axis=1))
    return unanswered


def _copy(source: RecheckedSteps, target: RecheckedSteps, row: int) -> None:
    """Copy the only row of a recheck."""
    for name in RecheckedSteps.__slots__:
        getattr(target, name)[row] = getattr(source, name)[0]
