"""HiGHS with a persistent object; a linear program starts from the previous basis."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any, Final

import highspy
import numpy as np

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram

COLUMN_WISE: Final = 1
TRIANGULAR: Final = 1
MINIMIZE: Final = 1
"""HiGHS' codes of a matrix format, a Hessian format and an objective sense."""


class HighsWorkspace:
    """A HiGHS object; its rows are those of G, then those of A, or one that constrains nothing.

    HiGHS 1.15 calls wrong points optimal where a quadratic program has bounds only.
    """

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._inequalities = 0 if program.h is None else len(program.h)
        self._rows = self._inequalities + (0 if program.b is None else len(program.b))
        m = max(1, self._rows)
        self._upper, self._lower = np.ones(m), np.full(m, -np.inf)
        self._values = np.zeros((n, m))
        self._starts = np.arange(n, dtype=np.int32) * m
        self._indices = np.tile(np.arange(m, dtype=np.int32), n)
        # The lower triangle column by column.
        columns, rows = np.triu_indices(n)
        self._triangle = rows * n + columns
        self._triangle_rows = rows.astype(np.int32)
        self._triangle_starts = np.cumsum([0, *range(n, 1, -1)]).astype(np.int32)
        self._no_bound = np.full(n, np.inf)
        self._continuous = np.zeros(n, dtype=np.int32)
        self._solver = highspy.Highs()
        self._solver.setOptionValue("log_to_console", False)
        for key, value in settings.items():
            self._solver.setOptionValue(key, value)
        self._basis: Any = None

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        n, m, i = len(program.q), len(self._upper), self._inequalities
        if program.G is not None:
            self._values[:, :i] = program.G.T
            self._upper[:i] = program.h
        if program.A is not None:
            self._values[:, i:] = program.A.T
            self._upper[i:] = program.b
            self._lower[i:] = program.b
        P_values = program.P.ravel()[self._triangle]
        linear = not P_values.any()
        solver = self._solver
        solver.passModel(
            n, m, n * m, 0 if linear else len(P_values), COLUMN_WISE, TRIANGULAR, MINIMIZE, 0.0,
            program.q,
            -self._no_bound if program.lb is None else program.lb,
            self._no_bound if program.ub is None else program.ub,
            self._lower, self._upper, self._starts, self._indices, self._values.ravel(),
            self._triangle_starts, self._triangle_rows, P_values, self._continuous,
        )  # fmt: skip
        if linear and self._basis is not None:
            solver.setBasis(self._basis)
        start = perf_counter_ns()
        solver.run()
        core_ns = perf_counter_ns() - start
        claimed = solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
        if linear:
            self._basis = solver.getBasis()
        solution = solver.getSolution()
        multipliers = -np.array(solution.row_dual)
        return Answer(
            np.array(solution.col_value),
            claimed,
            multipliers[i : self._rows],
            multipliers[:i],
            -np.array(solution.col_dual),
            core_ns,
        )
