"""Clarabel with a persistent solver, which saves the set-up but not the start from scratch."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any

import clarabel
import numpy as np
from scipy.sparse import csc_matrix

from dikbench.arrays import Array, Indices
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class ClarabelWorkspace:
    """A Clarabel solver; its rows are those of A, of G, finite upper and finite lower bounds."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._settings = settings
        rows, columns = np.tril_indices(n)
        self._triangle = rows * n + columns
        self._triangle_rows, self._triangle_starts = columns, np.cumsum([0, *range(1, n + 1)])
        self._equalities = 0 if program.b is None else len(program.b)
        self._dense = self._equalities + (0 if program.h is None else len(program.h))
        self._solver: Any = None
        self._finite: tuple[Indices, Indices, Indices] | None = None

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        finite = _finite(program.h), _finite(program.ub), _finite(program.lb)
        if self._finite is None or not all(map(np.array_equal, finite, self._finite)):
            self._set_up(program, finite)
        else:
            P_values, A_values, b = self._values(program)
            self._solver.update(P=P_values, q=program.q, A=A_values, b=b)
        start = perf_counter_ns()
        result = self._solver.solve()
        core_ns = perf_counter_ns() - start
        claimed = result.status == clarabel.SolverStatus.Solved
        return self._answer(program, np.array(result.x), np.array(result.z), claimed, core_ns)

    def _set_up(self, program: QuadraticProgram, finite: tuple[Indices, Indices, Indices]) -> None:
        """Lay the rows out: one for each finite right-hand side."""
        n = len(program.q)
        self._finite = finite
        inequalities, upper, lower = finite
        self._dense = self._equalities + len(inequalities)
        m = self._dense + len(upper) + len(lower)
        pattern = np.zeros((m, n))
        pattern[: self._dense] = 1.0
        pattern[self._dense + np.arange(len(upper)), upper] = 1.0
        pattern[self._dense + len(upper) + np.arange(len(lower)), lower] = -1.0
        self._columns = csc_matrix(pattern)
        self._of_dense = self._columns.indices < self._dense
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.presolve_enable = False  # it may drop rows, whose values cannot be updated then
        for key, value in self._settings.items():
            setattr(settings, key, value)
        cones: list[Any] = []
        if self._equalities:
            cones.append(clarabel.ZeroConeT(self._equalities))
        if m > self._equalities:
            cones.append(clarabel.NonnegativeConeT(m - self._equalities))
        P_values, A_values, b = self._values(program)
        P = csc_matrix((P_values, self._triangle_rows, self._triangle_starts), shape=(n, n))
        columns = self._columns
        A = csc_matrix((A_values, columns.indices, columns.indptr), shape=columns.shape)
        self._solver = clarabel.DefaultSolver(P, program.q, A, b, cones, settings)

    def _values(self, program: QuadraticProgram) -> tuple[Array, Array, Array]:
        """Return the values of P and A in the order of their patterns, and the right-hand side."""
        assert self._finite is not None
        inequalities, upper, lower = self._finite
        rows, sides = [], []
        if program.A is not None and program.b is not None:
            rows.append(program.A)
            sides.append(program.b)
        if program.G is not None and program.h is not None:
            rows.append(program.G[inequalities])
            sides.append(program.h[inequalities])
        if program.ub is not None:
            sides.append(program.ub[upper])
        if program.lb is not None:
            sides.append(-program.lb[lower])
        values = self._columns.data
        if rows:
            values = values.copy()
            values[self._of_dense] = np.vstack(rows).T.ravel()
        return program.P.ravel()[self._triangle], values, np.concatenate(sides)

    def _answer(
        self, program: QuadraticProgram, x: Array, push: Array, claimed: bool, core_ns: int
    ) -> Answer:
        assert self._finite is not None
        inequalities, upper, lower = self._finite
        z = np.zeros(0 if program.h is None else len(program.h))
        z[inequalities] = push[self._equalities : self._dense]
        z_box = np.zeros(len(x))
        z_box[upper] += push[self._dense : self._dense + len(upper)]
        z_box[lower] -= push[self._dense + len(upper) :]
        return Answer(x, claimed, push[: self._equalities], z, z_box, core_ns)


def _finite(bound: Array | None) -> Indices:
    """Return the indices of the finite entries of a bound."""
    none: Indices = np.empty(0, dtype=int)
    return none if bound is None else np.flatnonzero(np.isfinite(bound))
