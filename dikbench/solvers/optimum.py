"""How far an answer is from the optimum, which residuals cannot say near a singularity."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.array import Array
from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import Solver
from dikbench.solvers.cold import ColdSolver
from dikbench.solvers.residuals import residuals

JUDGE: Final = Solver("daqp", "cold", {})
"""An active-set method: where it answers it answers to rounding, and its own answer is checked."""

EXACT: Final = 1e-6
"""Residuals up to which the judge's own answer is taken for the optimum of a strictly convex
program."""

EXACT_COST: Final = 1e-4
"""The same for other programs, of which only the cost is compared: the judge smooths them."""


def distance_to_optimum(program: QuadraticProgram, answer: Answer) -> float:
    """Distance of an answer's x from the optimum, found by a solver of our own choice.

    Where P is positive definite the optimum x* is unique and this is max |x - x*| [rad/s]: near a
    singularity the cost is so flat that small residuals allow wrong velocities. Elsewhere it is the
    difference in cost (for alpha scaling: in alpha).

    Returns:
        The distance; NaN where the judge has no answer to trust.
    """
    assert answer.x is not None
    judged = ColdSolver(JUDGE)(program)
    if not judged.claimed or judged.x is None:
        return float("nan")
    found = residuals(program, judged)
    worst = max(found.primal, found.dual, found.gap)
    if _is_positive_definite(program.P):
        return float(np.abs(answer.x - judged.x).max()) if worst <= EXACT else float("nan")
    cost, best = (0.5 * x @ program.P @ x + program.q @ x for x in (answer.x, judged.x))
    return float(abs(cost - best)) if worst <= EXACT_COST else float("nan")


def _is_positive_definite(P: Array) -> bool:
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True
