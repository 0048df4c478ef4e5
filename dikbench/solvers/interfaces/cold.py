"""The cold interface: one call of qpsolvers per program, as most people use solvers."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import qpsolvers
from scipy.sparse import csc_matrix

from dikbench.arrays import plain
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver

SPARSE_BACK_ENDS: Final = frozenset({"osqp", "clarabel", "highs"})
"""Back ends that take sparse matrices; dense ones would cost a warning and a conversion."""

PINNED_DEFAULTS: Final[Mapping[str, Mapping[str, Any]]] = MappingProxyType(
    {"osqp": {"raise_error": False}}
)
"""Settings equal to today's defaults, named since the default will change (OSQP warns of it)."""

# The answer tells a failure; a warning about each would fill the output.
warnings.filterwarnings("ignore", module=r"qpsolvers\.")


class ColdSolver:
    """A back end called from scratch for every program."""

    __slots__ = ("_name", "_settings", "_sparse")

    def __init__(self, solver: Solver) -> None:
        self._name = solver.name
        self._settings = {**PINNED_DEFAULTS.get(solver.name, {}), **solver.settings}
        self._sparse = solver.name in SPARSE_BACK_ENDS

    def __call__(self, program: QuadraticProgram, site: int = 0) -> Answer:
        """Solve a program; any failure gives an answer that is not claimed."""
        G, h = program.G, program.h
        if self._name == "highs" and G is None and program.A is None:
            # HiGHS 1.15 calls wrong points optimal where there are bounds only; a row that
            # constrains nothing avoids it.
            G, h = np.zeros((1, len(program.q))), np.ones(1)
        problem = qpsolvers.Problem(
            self._matrix(program.P),
            plain(program.q),
            self._matrix(G),
            None if h is None else plain(h),
            self._matrix(program.A),
            None if program.b is None else plain(program.b),
            None if program.lb is None else plain(program.lb),
            None if program.ub is None else plain(program.ub),
        )
        try:
            solution = qpsolvers.solve_problem(problem, solver=self._name, **self._settings)
        except Exception:  # each library raises its own (qpsolvers does not wrap OSQP's)
            return Answer(None, claimed=False)
        x = solution.x
        claimed = bool(solution.found) and x is not None and bool(np.isfinite(x).all())
        core_ns = int(1e9 * (solution.solve_time or 0.0))
        return Answer(x, claimed, solution.y, solution.z, solution.z_box, core_ns)

    def _matrix(self, M: Any) -> Any:
        if M is None:
            return None
        return csc_matrix(M) if self._sparse else plain(M)
