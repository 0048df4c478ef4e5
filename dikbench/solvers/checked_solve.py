"""The `solve` that is handed to a law: timed, counted, its answers rechecked off the clock."""

from __future__ import annotations

from collections.abc import Callable
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

BATCH: Final = 512
"""Answers that wait for their recheck: many, since they are rechecked at once; not the whole run,
since each keeps its program."""

BackEnd = Callable[[Any, int], Answer]
"""(program, number of the call within its step) -> answer."""


class CheckedSolve:
    """One solver for one trial; the records are those of the current control step.

    Attributes:
        calls: number of programs solved.
        solve_ns: time inside the solver and its interface [ns].
        core_ns: the solver library's own share of it [ns].
        checking_ns: time spent on deciding why there is no answer, which is on nobody's clock [ns].
    """

    __slots__ = (
        "_back_end",
        "_checks",
        "_rechecked",
        "_solved",
        "_step",
        "_tolerance",
        "calls",
        "checking_ns",
        "core_ns",
        "solve_ns",
    )

    def __init__(
        self, back_end: BackEnd, *, tolerance: float = TOLERANCES["default"], checks: bool = True
    ) -> None:
        self._back_end = back_end
        self._tolerance = tolerance
        self._checks = checks
        self._solved: list[Solved] = []
        self._rechecked = RecheckedSteps(0)
        self.begin_run(1)
        self.begin_step(0)

    def begin_run(self, steps: int) -> None:
        """Forget everything, and make room for so many control steps."""
        self._solved.clear()
        self._rechecked = RecheckedSteps(steps)

    def begin_step(self, step: int) -> None:
        """Forget the records of the step before; its programs are kept for the recheck."""
        self._step = step
        self.calls = 0
        self.solve_ns = 0
        self.core_ns = 0
        self.checking_ns = 0
        if len(self._solved) >= BATCH:
            self._recheck()

    def rechecked(self) -> RecheckedSteps:
        """Recheck the answers that wait for it, and return what was found in the run so far."""
        self._recheck()
        return self._rechecked

    def _recheck(self) -> None:
        self._rechecked.recheck(self._solved, self._tolerance)
        self._solved.clear()

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
        # One product says whether there is an x and whether it is finite.
        if answer.claimed and x is not None and x.dot(x) < np.inf:
            return x
        error = self._reason(program)
        self.checking_ns += perf_counter_ns() - solved
        raise error

    def _reason(self, program: QuadraticProgram | ModelledProgram) -> Infeasible | SolverFailed:
        """Why there is no answer; the timing pass does not ask."""
        matrices = program.matrices() if isinstance(program, ModelledProgram) else program
        if not is_finite(matrices):
            return SolverFailed("the program holds NaN or infinity")
        if not self._checks or is_feasible(matrices):
            return SolverFailed("the solver gave no answer to a feasible program")
        return Infeasible("the program has no feasible point")


class NoSolve(CheckedSolve):
    """The `solve` of a law that declared that it needs none."""

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__(_refuse)


def _refuse(program: object, site: int) -> Answer:
    raise DikbenchError("the law called solve but declares no program; set program = 'qp' or 'lp'")


def make_solve(
    solver: Solver | None, program: ProgramKind | None, *, checks: bool = True
) -> CheckedSolve:
    """Build the `solve` for one trial.

    Args:
        solver: the solver of the trial, or None for a law that needs none.
        program: what the law solves (see `Program`).
        checks: whether answers are rechecked (the timing pass does not, so that every solver finds
            the caches as its law left them).
    """
    if solver is None or program is None:
        return NoSolve()
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
