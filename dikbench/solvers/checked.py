"""The `solve` that is handed to a law: timed, counted, its answers rechecked."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter_ns
from typing import Any

import numpy as np

from dikbench.array import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.modelled_program import ModelledProgram
from dikbench.quadratic_program import Program, QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import Solver
from dikbench.solvers.feasibility import is_feasible
from dikbench.solvers.residuals import residuals

VERIFIED_DISTANCE = 1e-2
"""The largest distance from the optimum of a verified answer [rad/s; alpha for alpha scaling]."""


class CheckedSolve:
    """One solver for one trial; the records are those of the current control step.

    Attributes:
        calls: number of programs solved.
        solve_ns: time inside the solver and its interface [ns].
        core_ns: the solver library's own share of it [ns].
        checking_ns: time spent on rechecking, which belongs to nobody's clock [ns].
        primal, dual, gap: the largest residuals of the step (see `residuals`); NaN where one is
            not known.
        distance: largest distance from the optimum (see `distance_to_optimum`); NaN where it is
            not known.
        verified: whether every answer that claimed success was within tolerance.
    """

    __slots__ = (
        "_back_end",
        "_checks",
        "calls",
        "checking_ns",
        "core_ns",
        "distance",
        "dual",
        "gap",
        "primal",
        "solve_ns",
        "verified",
    )

    def __init__(self, back_end: Callable[[Any], Answer], *, checks: bool = True) -> None:
        self._back_end = back_end
        self._checks = checks
        self.begin_step()

    def begin_step(self) -> None:
        """Forget the records of the step before."""
        self.calls = 0
        self.solve_ns = 0
        self.core_ns = 0
        self.checking_ns = 0
        self.primal = 0.0
        self.dual = 0.0
        self.gap = 0.0
        self.distance = 0.0
        self.verified = True

    def __call__(self, program: QuadraticProgram | ModelledProgram) -> Array:
        """Solve a program (see `Solve`)."""
        start = perf_counter_ns()
        answer = self._back_end(program)
        solved = perf_counter_ns()
        self.calls += 1
        self.solve_ns += solved - start
        self.core_ns += answer.core_ns
        try:
            return self._checked(program, answer)
        finally:
            self.checking_ns += perf_counter_ns() - solved

    def _checked(self, program: QuadraticProgram | ModelledProgram, answer: Answer) -> Array:
        if not self._checks and answer.claimed and answer.x is not None:
            return answer.x
        matrices = program.matrices() if isinstance(program, ModelledProgram) else program
        if not answer.claimed or answer.x is None:
            if is_feasible(matrices):
                raise SolverFailed("the solver gave no answer to a feasible program")
            raise Infeasible("the program has no feasible point")
        found = residuals(matrices, answer)
        self.primal = max(self.primal, found.primal)
        self.dual = float(np.maximum(self.dual, found.dual))  # what is not known stays NaN
        self.gap = float(np.maximum(self.gap, found.gap))
        from dikbench.solvers.optimum import distance_to_optimum

        distance = distance_to_optimum(matrices, answer)
        self.distance = float(np.maximum(self.distance, distance))
        self.verified = self.verified and found.verified and not distance > VERIFIED_DISTANCE
        return answer.x


class NoSolve(CheckedSolve):
    """The `solve` of a law that declared that it needs none."""

    __slots__ = ()

    def __init__(self) -> None:
        super().__init__(_refuse)


def _refuse(program: object) -> Answer:
    raise DikbenchError("the law called solve but declares no program; set program = 'qp' or 'lp'")


def make_solve(
    solver: Solver | None, program: Program | None, *, checks: bool = True
) -> CheckedSolve:
    """Build the `solve` for one trial.

    Args:
        solver: the solver of the trial, or None for a law that needs none.
        program: what the law solves (see `Program`).
        checks: whether answers that claim success are rechecked (the timing pass does not, so that
            every solver finds the caches as its law left them).
    """
    if solver is None or program is None:
        return NoSolve()
    if program == "cvxpy" or solver.interface == "cvxpy":
        from dikbench.solvers.modelled import ModelledSolver

        return CheckedSolve(ModelledSolver(solver), checks=checks)
    from dikbench.solvers.cold import ColdSolver

    return CheckedSolve(ColdSolver(solver), checks=checks)
