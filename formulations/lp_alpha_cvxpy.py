"""Alpha scaling written in cvxpy's modelling language."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    Braking,
    DikProblem,
    Drawn,
    LimitKind,
    ModelledProgram,
    Parameters,
    ProgramKind,
    Range,
    Solve,
)
from formulations.lp_alpha import alpha_program, regularization_for


@dataclass(frozen=True)
class LpAlphaCvxpy(Parameters):
    """Alpha scaling as it is usually written in cvxpy: the program of `lp-alpha`.

        maximise   alpha - 1/2 rho ||v||^2
        subject to J v == alpha V,   0 <= alpha <= 1,   lo <= v,   v <= hi

    J, V, lo and hi are parameters (disciplined parametrised programming), so that the model is
    compiled once per process and shape. It gives the alpha of `lp-alpha` in a hundred times its
    time.

    Attributes:
        regularization: rho; None: 1e-4 if the arm has more joints than the task has rows, else 0.
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).

    Source: [Tedrake], chapter 3; [DiamondBoyd2016].
    """

    regularization: Annotated[float | None, Range(0.0), Drawn(1e-6, 1e-2, log=True)] = None
    braking: Braking = "viable"

    program: ClassVar[ProgramKind] = "cvxpy"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        rho = regularization_for(task, self.regularization)
        box = problem.box(self.braking)
        below, above = (tuple(map(bool, np.isfinite(side))) for side in (box.lower, box.upper))
        model, unknowns, given = _compiled(len(task.V), below, above, rho)
        values = {
            "J": task.J,
            "V": task.V,
            "lo": box.lower[list(below)],
            "hi": box.upper[list(above)],
        }
        for name, parameter in given.items():
            parameter.value = values[name]
        x = solve(ModelledProgram(model, unknowns, lambda: alpha_program(task, box, rho)))
        return x[: problem.robot.nv]


@lru_cache(maxsize=32)
def _compiled(
    m: int, below: tuple[bool, ...], above: tuple[bool, ...], rho: float
) -> tuple[Any, tuple[Any, Any], dict[str, Any]]:
    """Compile the model of a task of m rows; return it, its unknowns and its parameters.

    `below` and `above` say, joint by joint, which velocities are bounded at all.
    """
    import cvxpy  # takes a second, and only this formulation needs it

    n = len(below)
    v, alpha = cvxpy.Variable(n), cvxpy.Variable()
    given = {"J": cvxpy.Parameter((m, n)), "V": cvxpy.Parameter(m)}
    constraints = [given["J"] @ v == alpha * given["V"], alpha >= 0, alpha <= 1]
    if any(below):
        given["lo"] = cvxpy.Parameter(sum(below))
        constraints.append(v[np.flatnonzero(below)] >= given["lo"])
    if any(above):
        given["hi"] = cvxpy.Parameter(sum(above))
        constraints.append(v[np.flatnonzero(above)] <= given["hi"])
    objective = alpha - rho / 2 * cvxpy.sum_squares(v) if rho > 0 else alpha
    return cvxpy.Problem(cvxpy.Maximize(objective), constraints), (v, alpha), given
