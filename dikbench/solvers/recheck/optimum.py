"""How far answers are from the optimum, which residuals cannot say near a singularity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.back_ends import Solver
from dikbench.solvers.interfaces.cold import ColdSolver
from dikbench.solvers.recheck.residuals import residuals
from dikbench.solvers.recheck.stack import Stack

JUDGE: Final = Solver("daqp", "cold", {})
"""An active-set method: where it answers it answers to rounding, and its own answer is checked."""

EXACT: Final = 1e-6
"""Residuals up to which the judge's own answer is taken for the optimum of a strictly convex
program."""

EXACT_COST: Final = 1e-4
"""The same for other programs, of which only the cost is compared: the judge smooths them."""

PROVEN: Final = 1e-4
"""A distance up to which the residuals themselves are proof enough, and no judge is asked."""


def distance_to_optimum(
    programs: Sequence[QuadraticProgram], answers: Sequence[Answer], nearness: Array
) -> Array:
    """Compute the distance of each answer's x from the optimum.

    Where P is positive definite the optimum x* is unique and this is max |x - x*| [rad/s]: near a
    singularity the cost is so flat that small residuals allow wrong velocities. Elsewhere it is the
    difference in cost (for alpha scaling: in alpha).

    Args:
        programs: k of them.
        answers: to them, all with an x.
        nearness: a bound on the distance (see `Residuals`), (k,); where it is small it is taken for
            the distance, elsewhere a solver of our own choice is asked.

    Returns:
        The distances, (k,); NaN where the judge has no answer to trust.
    """
    distance = np.where(nearness <= PROVEN, nearness, np.nan)
    judge = ColdSolver(JUDGE)
    for k in np.flatnonzero(np.isnan(distance)).tolist():
        program, x = programs[k], answers[k].x
        assert x is not None
        judged = judge(program)
        if not judged.claimed or judged.x is None:
            continue
        found = residuals(Stack([program], [judged]))
        worst = float(max(found.primal[0], found.dual[0], found.gap[0]))
        if _is_positive_definite(program.P):
            if worst <= EXACT:
                distance[k] = np.abs(x - judged.x).max()
        elif worst <= EXACT_COST:
            cost, best = (0.5 * p @ program.P @ p + program.q @ p for p in (x, judged.x))
            distance[k] = abs(cost - best)
    return distance


def _is_positive_definite(P: Array) -> bool:
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True
