"""PIQP with a persistent dense solver: an interior point method, so every solve starts afresh."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any

import piqp

from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer


class PiqpWorkspace:
    """A dense PIQP solver; it skips infinite bounds itself."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        self._solver = piqp.DenseSolver()
        self._solver.settings.verbose = False
        for key, value in settings.items():
            setattr(self._solver.settings, key, value)
        self._is_set_up = False

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        solver = self._solver
        take = solver.update if self._is_set_up else solver.setup
        # It wants columns: the transpose of a symmetric matrix is that without a copy.
        take(
            program.P.T, program.q, program.A, program.b, program.G, None, program.h,
            program.lb, program.ub,
        )  # fmt: skip
        self._is_set_up = True
        start = perf_counter_ns()
        status = solver.solve()
        core_ns = perf_counter_ns() - start
        result = solver.result
        return Answer(
            result.x.copy(),
            status == piqp.PIQP_SOLVED,
            result.y.copy(),
            result.z_u.copy(),
            result.z_bu - result.z_bl,
            core_ns,
        )
