"""OSQP with a persistent workspace, whose sparsity pattern is that of dense matrices."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any

import numpy as np
import osqp
from scipy.sparse import csc_matrix

from dikbench.arrays import plain
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class OsqpWorkspace:
    """An OSQP workspace; its rows are those of G, then those of A, then one for each bounded x."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._inequalities = 0 if program.h is None else len(program.h)
        self._dense = self._inequalities + (0 if program.b is None else len(program.b))
        bounded = program.lb is not None or program.ub is not None
        m = self._dense + (n if bounded else 0)
        self._upper, self._lower = np.full(m, np.inf), np.full(m, -np.inf)
        # The upper triangle column by column is, P being symmetric, the lower one row by row.
        rows, columns = np.tril_indices(n)
        self._triangle = rows * n + columns
        self._triangle_rows, self._triangle_starts = columns, np.cumsum([0, *range(1, n + 1)])
        # Column j holds the dense rows and, where x is bounded, a 1.
        self._values = np.ones((n, self._dense + bounded))
        own = np.arange(self._dense, m).reshape(-1, 1) if bounded else np.empty((n, 0), dtype=int)
        dense = np.tile(np.arange(self._dense), (n, 1))
        self._rows = np.hstack([dense, own]).ravel()
        self._starts = np.arange(n + 1) * self._values.shape[1]
        self._shape = (m, n)
        self._settings = settings
        self._solver: Any = None

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        i, j = self._inequalities, self._dense
        if program.G is not None:
            self._values[:, :i] = program.G.T
            self._upper[:i] = program.h
        if program.A is not None:
            self._values[:, i:j] = program.A.T
            self._upper[i:j] = program.b
            self._lower[i:j] = program.b
        if program.ub is not None:
            self._upper[j:] = program.ub
        if program.lb is not None:
            self._lower[j:] = program.lb
        if (self._lower > self._upper).any():  # OSQP would keep the previous bounds
            return Answer(None, claimed=False)
        P_values, q = program.P.ravel()[self._triangle], plain(program.q)
        if self._solver is None:
            self._set_up(program, P_values)
        elif j:
            self._solver.update(
                q=q, l=self._lower, u=self._upper, Px=P_values, Ax=self._values.ravel()
            )
        else:
            self._solver.update(q=q, l=self._lower, u=self._upper, Px=P_values)
        start = perf_counter_ns()
        result = self._solver.solve(raise_error=False)
        core_ns = perf_counter_ns() - start
        claimed = result.info.status_val == osqp.SolverStatus.OSQP_SOLVED
        multipliers = np.array(result.y)
        y, z, z_box = multipliers[i:j], multipliers[:i], multipliers[j:]
        return Answer(np.array(result.x), claimed, y, z, z_box, core_ns)

    def _set_up(self, program: QuadraticProgram, P_values: Any) -> None:
        n = len(program.q)
        P = csc_matrix((P_values, self._triangle_rows, self._triangle_starts), shape=(n, n))
        A = csc_matrix((self._values.ravel(), self._rows, self._starts), shape=self._shape)
        self._solver = osqp.OSQP()
        self._solver.setup(
            P, program.q, A, self._lower, self._upper, verbose=False, **self._settings
        )
