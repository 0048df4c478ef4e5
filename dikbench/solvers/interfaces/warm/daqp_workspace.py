"""daqp with a persistent model: its active set is where the next solve starts."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import Any, Final

import daqp
import numpy as np

from dikbench.arrays import Array, plain
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram

DAQP_INFINITY: Final = 1e30

EQUALITY_FLAGS: Final = 5
"""daqp's flags of a row that is active and stays active."""


class DaqpWorkspace:
    """A daqp model; its constraints are bounds on x, then the rows of G, then those of A."""

    def __init__(self, program: QuadraticProgram, settings: Mapping[str, Any]) -> None:
        n = len(program.q)
        self._bounds = 0 if program.lb is None and program.ub is None else n
        self._first_equality = self._bounds + (0 if program.h is None else len(program.h))
        m = self._first_equality + (0 if program.b is None else len(program.b))
        self._rows = np.zeros((m - self._bounds, n))
        self._upper, self._lower = np.full(m, DAQP_INFINITY), np.full(m, -DAQP_INFINITY)
        sense = np.zeros(m, dtype=np.int32)
        sense[self._first_equality :] = EQUALITY_FLAGS
        self._has_rows = len(self._rows) > 0
        self._model = daqp.Model()
        self._fill(program)
        P, q = plain(program.P), plain(program.q)
        self._model.setup(P, q, self._rows, self._upper, self._lower, sense)
        self._model.settings = dict(settings)

    def solve(self, program: QuadraticProgram) -> Answer:
        """See `Workspace`."""
        model, P, q = self._model, plain(program.P), plain(program.q)
        upper, lower = program.ub, program.lb
        if self._has_rows:
            self._fill(program)
            flag = model.update(H=P, f=q, A=self._rows, bupper=self._upper, blower=self._lower)
        elif upper is self._last_upper and lower is self._last_lower and _is_fixed(upper, lower):
            flag = model.update(H=P, f=q)
        else:
            self._fill(program)
            flag = model.update(H=P, f=q, bupper=self._upper, blower=self._lower)
        if flag < 0:
            return Answer(None, claimed=False)
        start = perf_counter_ns()
        x, _, flag, info = model.solve()
        core_ns = perf_counter_ns() - start
        multipliers = info["lam"]
        if self._has_rows:
            i, j = self._bounds, self._first_equality
            y, z, z_box = multipliers[j:], multipliers[i:j], multipliers[:i]
            return Answer(x, flag > 0, y, z, z_box, core_ns)
        return Answer(x, flag > 0, None, None, multipliers, core_ns)

    def _fill(self, program: QuadraticProgram) -> None:
        self._last_upper, self._last_lower = program.ub, program.lb
        i, j = self._bounds, self._first_equality
        if program.ub is not None:
            np.minimum(program.ub, DAQP_INFINITY, out=self._upper[:i])
        if program.lb is not None:
            np.maximum(program.lb, -DAQP_INFINITY, out=self._lower[:i])
        if program.G is not None and program.h is not None:
            np.minimum(program.h, DAQP_INFINITY, out=self._upper[i:j])
            self._rows[: j - i] = program.G
        if program.A is not None:
            self._upper[j:] = program.b
            self._lower[j:] = program.b
            self._rows[j - i :] = program.A


def _is_fixed(upper: Array | None, lower: Array | None) -> bool:
    """Say whether bounds are read-only, so that the same arrays hold the same values."""
    return (upper is None or not upper.flags.writeable) and (
        lower is None or not lower.flags.writeable
    )
