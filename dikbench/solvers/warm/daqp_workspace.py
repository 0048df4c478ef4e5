"""daqp with a persistent model: its active set is where the next solve starts."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any, Final

import daqp
import numpy as np

from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer

INFINITE: Final = 1e30
"""daqp's own infinity."""

EQUALITY: Final = 5
"""daqp's flags of a row that is active and stays so."""


class DaqpWorkspace:
    """daqp's constraints are bounds on x, then the rows of G, then those of A."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._bounds = 0 if program.lb is None and program.ub is None else n
        self._first_equality = self._bounds + (0 if program.h is None else len(program.h))
        m = self._first_equality + (0 if program.b is None else len(program.b))
        self._rows = np.zeros((m - self._bounds, n))
        self._upper, self._lower = np.full(m, INFINITE), np.full(m, -INFINITE)
        self._sense = np.zeros(m, dtype=np.int32)
        self._sense[self._first_equality :] = EQUALITY
        self._model = daqp.Model()
        self._settings = dict(settings)
        self._is_set_up = False

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        self._fill(program)
        # daqp takes no read-only arrays; its own are these.
        P = program.P if program.P.flags.writeable else program.P.copy()
        q = program.q if program.q.flags.writeable else program.q.copy()
        model, rows, upper, lower = self._model, self._rows, self._upper, self._lower
        if self._is_set_up:
            A = rows if len(rows) else None
            flag = model.update(H=P, f=q, A=A, bupper=upper, blower=lower)
        else:
            flag, _ = model.setup(P, q, rows, upper, lower, self._sense)
            model.settings = self._settings
            self._is_set_up = True
        if flag < 0:
            return Answer(None, claimed=False)
        start = perf_counter_ns()
        x, _, flag, info = model.solve()
        core_ns = perf_counter_ns() - start
        pushes = info["lam"]
        if len(rows):
            i, j = self._bounds, self._first_equality
            return Answer(x, flag > 0, pushes[j:], pushes[i:j], pushes[:i], core_ns)
        return Answer(x, flag > 0, z_box=pushes, core_ns=core_ns)

    def _fill(self, program: QuadraticProgram) -> None:
        i, j = self._bounds, self._first_equality
        if program.ub is not None:
            self._upper[:i] = program.ub
        if program.lb is not None:
            self._lower[:i] = program.lb
        if program.G is not None:
            self._upper[i:j] = program.h
            self._rows[: j - i] = program.G
        if program.A is not None:
            self._upper[j:] = program.b
            self._lower[j:] = program.b
            self._rows[j - i :] = program.A
