"""Whether a program has a feasible point: an infeasible program or a failed solver?"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import linprog

from dikbench.programs.quadratic_program import QuadraticProgram

LINPROG_INFEASIBLE: Final = 2


def is_finite(program: QuadraticProgram) -> bool:
    """Whether matrices and right-hand sides are numbers; h and bounds may be infinite."""
    numbers = (program.P, program.q, program.G, program.A, program.b)
    sides = (program.h, program.lb, program.ub)
    return all(part is None or bool(np.isfinite(part).all()) for part in numbers) and not any(
        part is not None and bool(np.isnan(part).any()) for part in sides
    )


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
