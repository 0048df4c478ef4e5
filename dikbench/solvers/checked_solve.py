"""The `solve` of a formulation: timed, counted, its answers rechecked outside the timing."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from time import perf_counter_ns
from typing import Any, Final

import msgspec
import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.programs.answer import Answer
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.solvers.recheck.feasibility import is_feasible, is_finite
from dikbench.solvers.recheck.rechecked import RecheckedSteps, Solved

ANSWERS_PER_RECHECK: Final = 512
"""Answers that are rechecked together: many, since that is faster; not all of a run, since each
keeps its program in memory."""

BackEnd = Callable[[Any, int], Answer]
"""(program, number of the call within its step) -> answer."""


class CheckedSolve:
    """The solver of one trial, with the records of the current control step.

    Attributes:
        calls: number of programs solved.
        solve_ns: time inside the solver and its interface [ns].
        core_ns: time inside the solver library alone [ns].
        tolerance: largest residual of a verified answer.
        checking_ns: time spent on deciding why there is no answer, which counts for nobody [ns].
    """

    __slots__ = (
        "_back_end",
        "_checks",
        "_rechecked",
        "_solved",
        "_step",
        "calls",
        "checking_ns",
        "core_ns",
        "solve_ns",
        "tolerance",
    )

    def __init__(
        self, back_end: BackEnd, *, tolerance: float = TOLERANCES["default"], checks: bool = True
    ) -> None:
        self._back_end = back_end
        self.tolerance = tolerance
        self._checks = checks
        self._solved: list[Solved] = []
        self._rechecked = RecheckedSteps(0)
        self.begin_run(1)
        self.begin_step(0)

    def begin_run(self, steps: int) -> None:
        """Forget everything, and allocate records for a number of control steps."""
        self._solved.clear()
        self._rechecked = RecheckedSteps(steps)

    def begin_step(self, step: int) -> None:
        """Reset the records of the previous step; its programs are kept for the recheck."""
        self._step = step
        self.calls = 0
        self.solve_ns = 0
        self.core_ns = 0
        self.checking_ns = 0
        if len(self._solved) >= ANSWERS_PER_RECHECK:
            self._recheck()

    def rechecked(self) -> RecheckedSteps:
        """Recheck the remaining answers, and return the results of the run so far."""
        self._recheck()
        return self._rechecked

    def _recheck(self) -> None:
        self._rechecked.recheck(self._solved, self.tolerance)
        self._solved.clear()

    def answer(self, program: QuadraticProgram, call: int) -> Answer:
        """Ask the back end, without a record of it; `call` is the number within the step."""
        return self._back_end(program, call)

    def __call__(self, program: QuadraticProgram | ModelledProgram) -> Array:
        """Solve a program (see `Solve`)."""
        start = perf_counter_ns()
        answer = self._back_end(program, self.calls)
        solved = perf_counter_ns()
        self.calls += 1
        self.solve_ns += solved - start
        self.core_ns += answer.core_ns
        if self._checks:
            self._solved.append((self._step, program, answer))
        x = answer.x
        # One product tells whether x is finite.
        if answer.claimed and x is not None and x.dot(x) < np.inf:
            return x
        error = self._reason(program)
        self.checking_ns += perf_counter_ns() - solved
        raise error

    def verify(
        self,
        program: QuadraticProgram,
        x: Array,
        y: Array | None = None,
        z: Array | None = None,
        z_box: Array | None = None,
    ) -> None:
        """Recheck what the formulation solved itself (see `Solve.verify`)."""
        if not self._checks:
            return
        start = perf_counter_ns()
        # The formulation may write into its arrays before the recheck comes to them.
        answer = Answer(np.array(x, dtype=float), claimed=True, y=y, z=z, z_box=z_box)
        self._solved.append((self._step, deepcopy(program), deepcopy(answer)))
        self.checking_ns += perf_counter_ns() - start

    def _reason(self, program: QuadraticProgram | ModelledProgram) -> Infeasible | SolverFailed:
        """Decide why there is no answer; the timing pass does not ask."""
        matrices = program.matrices() if isinstance(program, ModelledProgram) else program
        if not is_finite(matrices):
            return SolverFailed("the program holds NaN or infinity")
        if not self._checks or is_feasible(matrices):
            return SolverFailed("the solver gave no answer to a feasible program")
        return Infeasible("the program has no feasible point")


class NoSolve(CheckedSolve):
    """The `solve` of a formulation that declares no program."""

    __slots__ = ()

    def __init__(self, *, checks: bool = True) -> None:
        super().__init__(_refuse, checks=checks)


def _refuse(program: object, site: int) -> Answer:
    raise DikbenchError(
        "the formulation called solve but declares no program; set program = 'qp' or 'lp'"
    )


def make_solve(
    solver: Solver | None, program: ProgramKind | None, *, checks: bool = True
) -> CheckedSolve:
    """Build the `solve` for one trial.

    Args:
        solver: the solver of the trial, or None for a formulation that needs none.
        program: what the formulation solves (see `ProgramKind`).
        checks: whether answers are rechecked; not in the timing pass, where a recheck would
            change the caches.
    """
    if solver is None or program is None:
        return NoSolve(checks=checks)
    back_end = _back_end(solver, program)
    if solver.then is not None:
        back_end = _InTurn(back_end, _back_end(solver.then, program))
    return CheckedSolve(back_end, tolerance=solver.tolerance, checks=checks)


def _back_end(solver: Solver, program: ProgramKind) -> BackEnd:
    if program == "cvxpy" or solver.interface == "cvxpy":
        from dikbench.solvers.interfaces.through_cvxpy import ModelledSolver

        return ModelledSolver(solver)
    if solver.interface == "warm":
        from dikbench.solvers.interfaces.warm import WarmSolver

        return WarmSolver(solver)
    if solver.library is not None:
        from dikbench.solvers.interfaces.of_library import LibrarySolver

        return LibrarySolver(solver.library)
    from dikbench.solvers.interfaces.cold import ColdSolver

    return ColdSolver(solver)


class _InTurn:
    """Two back ends: the second one is asked where the first gives no answer."""

    __slots__ = ("_first", "_second")

    def __init__(self, first: BackEnd, second: BackEnd) -> None:
        self._first = first
        self._second = second

    def __call__(self, program: Any, site: int) -> Answer:
        """Solve a program; the core time is that of all who were asked."""
        first = self._first(program, site)
        x = first.x
        if first.claimed and x is not None and x.dot(x) < np.inf:
            return first
        second = self._second(program, site)
        core_ns = first.core_ns + second.core_ns
        return msgspec.structs.replace(second, core_ns=core_ns)
