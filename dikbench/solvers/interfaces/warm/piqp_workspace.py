"""PIQP with a persistent dense solver: an interior point method without warm start."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any

import numpy as np
import piqp

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class PiqpWorkspace:
    """A dense PIQP solver; it skips infinite bounds itself."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        self._settings = settings
        self._solver: Any = None

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        # PIQP drops a row with an infinite side permanently at its set-up.
        lasting = program.h is None or bool(np.isfinite(program.h).all())
        if self._solver is None or not lasting:
            solver = self._new()
            take = solver.setup
        else:
            solver = self._solver
            take = solver.update
        self._solver = solver if lasting else None
        # PIQP reads columns: the transpose of a symmetric matrix has them without a copy.
        take(
            program.P.T, program.q, program.A, program.b, program.G, None, program.h,
            program.lb, program.ub,
        )  # fmt: skip
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

    def _new(self) -> Any:
        solver = piqp.DenseSolver()
        solver.settings.verbose = False
        for key, value in self._settings.items():
            setattr(solver.settings, key, value)
        return solver
