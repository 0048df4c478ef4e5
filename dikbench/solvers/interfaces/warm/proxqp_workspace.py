"""ProxQP with a persistent dense solver that starts from its last answer."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any

import numpy as np
from proxsuite import proxqp

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class ProxqpWorkspace:
    """A dense ProxQP solver: its inequality multipliers are those of G, then those of the box."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._inequalities = 0 if program.h is None else len(program.h)
        m = 0 if program.b is None else len(program.b)
        self._bounded = program.lb is not None or program.ub is not None
        self._none = np.full(n, np.inf)
        self._below = np.full(self._inequalities, -np.inf)
        self._solver = proxqp.dense.QP(n, m, self._inequalities, self._bounded)
        # Without this guess the first solve at times takes zeros for an answer.
        self._solver.settings.initial_guess = proxqp.InitialGuess.EQUALITY_CONSTRAINED_INITIAL_GUESS
        for key, value in settings.items():
            setattr(self._solver.settings, key, value)
        self._is_set_up = False

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        solver = self._solver
        upper, lower = program.ub, program.lb
        if upper is not None and lower is not None and (lower > upper).any():
            return Answer(None, claimed=False)
        take = solver.update if self._is_set_up else solver.init
        below = self._below if program.G is not None else None
        if self._bounded:
            lower = -self._none if lower is None else lower
            upper = self._none if upper is None else upper
            take(
                program.P, program.q, program.A, program.b, program.G, below, program.h,
                lower, upper,
            )  # fmt: skip
        else:
            take(program.P, program.q, program.A, program.b, program.G, below, program.h)
        start = perf_counter_ns()
        solver.solve()
        core_ns = perf_counter_ns() - start
        if not self._is_set_up:
            self._is_set_up = True
            solver.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
        results = solver.results
        multipliers = results.z.copy()
        return Answer(
            results.x.copy(),
            results.info.status == proxqp.QPSolverOutput.PROXQP_SOLVED,
            results.y.copy(),
            multipliers[: self._inequalities],
            multipliers[self._inequalities :],
            core_ns,
        )
