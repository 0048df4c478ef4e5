"""How far an answer is from the optimum, which residuals cannot say near a singularity."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import Solver
from dikbench.solvers.cold import ColdSolver
from dikbench.solvers.residuals import residuals

JUDGE: Final = Solver("daqp", "cold", {})
"""An active-set method: where it answers it answers to rounding, and its own answer is checked."""

EXACT: Final = 1e-6
"""Residuals up to which the judge's own answer is taken for the optimum."""


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
    if not max(found.primal, found.dual, found.gap) <= EXACT:
        return float("nan")
    try:
        np.linalg.cholesky(program.P)
    except np.linalg.LinAlgError:
        cost, best = (0.5 * x @ program.P @ x + program.q @ x for x in (answer.x, judged.x))
        return float(abs(cost - best))
    return float(np.abs(answer.x - judged.x).max())
