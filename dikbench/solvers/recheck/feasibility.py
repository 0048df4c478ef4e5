"""Whether a program has a feasible point: an infeasible program or a failed solver?"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import linprog

from dikbench.programs.quadratic_program import QuadraticProgram

LINPROG_INFEASIBLE: Final = 2


def is_feasible(program: QuadraticProgram) -> bool:
    """Say whether HiGHS' simplex method finds no contradiction (feasibility tolerance 1e-7)."""
    n = len(program.q)
    lower = np.full(n, -np.inf) if program.lb is None else program.lb
    upper = np.full(n, np.inf) if program.ub is None else program.ub
    if np.any(lower > upper):
        return False
    G, h = program.G, program.h
    if G is not None and h is not None:
        bounded = h < np.inf  # a relaxed bound constrains nothing
        G, h = G[bounded], h[bounded]
    result = linprog(
        np.zeros(n),
        A_ub=G,
        b_ub=h,
        A_eq=program.A,
        b_eq=program.b,
        bounds=np.column_stack([lower, upper]),
        method="highs",
    )
    return bool(result.status != LINPROG_INFEASIBLE)
