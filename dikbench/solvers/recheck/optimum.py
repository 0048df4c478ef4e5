"""Distances of answers from the optimum, which residuals do not bound near a singularity."""

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

JUDGE_SOLVER: Final = Solver("daqp", "cold", {})
"""An active-set method, whose answers are exact up to rounding; they are checked as well."""

JUDGE_RESIDUAL_CONVEX: Final = 1e-6
"""Largest residual of a judge's answer that counts as the optimum of a strictly convex program."""

JUDGE_RESIDUAL: Final = 1e-4
"""The same for other programs, of which the cost is compared; the judge smooths them."""

PROVEN_DISTANCE: Final = 1e-4
"""Up to this bound on the distance, which follows from the residuals, no judge is needed."""


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
        nearness: a bound on the distance (see `Residuals`), (k,); where it is small it is taken as
            the distance, elsewhere the judge solves the program.

    Returns:
        The distances, (k,); NaN where the judge's answer does not pass its own check.
    """
    distance = np.where(nearness <= PROVEN_DISTANCE, nearness, np.nan)
    judge = ColdSolver(JUDGE_SOLVER)
    for k in np.flatnonzero(np.isnan(distance)).tolist():
        program, x = programs[k], answers[k].x
        assert x is not None
        judged = judge(program)
        if not judged.claimed or judged.x is None:
            continue
        found = residuals(Stack([program], [judged]))
        worst = float(max(found.primal[0], found.dual[0], found.gap[0]))
        if _is_positive_definite(program.P):
            if worst <= JUDGE_RESIDUAL_CONVEX:
                distance[k] = np.abs(x - judged.x).max()
        elif worst <= JUDGE_RESIDUAL:
            cost, best = (0.5 * p @ program.P @ p + program.q @ p for p in (x, judged.x))
            distance[k] = abs(cost - best)
    return distance


def _is_positive_definite(P: Array) -> bool:
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        return False
    return True
