"""Alpha scaling written in cvxpy's modelling words."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

from dikbench.array import Array
from dikbench.box import Braking
from dikbench.errors import DikbenchError
from dikbench.modelled_program import ModelledProgram
from dikbench.problem import DikProblem, LimitKind, Solve
from dikbench.quadratic_program import Program
from formulations.lp_alpha import alpha_program, regularization_for


@dataclass(frozen=True)
class LpAlphaCvxpy:
    """Alpha scaling as people write it in cvxpy: the program of `lp-alpha`, word for word.

        maximise   alpha - 1/2 rho ||v||^2
        subject to J v == alpha V,   0 <= alpha <= 1,   lo <= v,   v <= hi

    J, V, lo and hi are parameters (disciplined parametrised programming), so that the model is
    compiled once per process and shape. Same alpha as `lp-alpha`, a hundred times its price.

    Attributes:
        regularization: rho; None: 1e-4 if the arm has more joints than the task has rows, else 0.
        braking: how the box approaches a position limit (see `dikbench.box`).

    Source: Tedrake, Robotic Manipulation, ch. 3; Diamond & Boyd (2016), CVXPY.
    """

    regularization: float | None = None
    braking: Braking = "viable"

    program: ClassVar[Program] = "cvxpy"
    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    def __post_init__(self) -> None:
        """Check the parameters."""
        if self.regularization is not None and not self.regularization >= 0:
            raise DikbenchError("lp-alpha-cvxpy: regularization must be at least 0")

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        rho = regularization_for(task, self.regularization)
        box = problem.box(self.braking)
        model, unknowns, given = _compiled(*task.J.shape, rho)
        given["J"].value, given["V"].value = task.J, task.V
        given["lo"].value, given["hi"].value = box.lower, box.upper
        x = solve(ModelledProgram(model, unknowns, lambda: alpha_program(task, box, rho)))
        return x[: problem.robot.nv]


@lru_cache(maxsize=32)
def _compiled(m: int, n: int, rho: float) -> tuple[Any, tuple[Any, Any], dict[str, Any]]:
    """The model for a task of m rows and an arm of n joints, its unknowns and its parameters."""
    import cvxpy

    v, alpha = cvxpy.Variable(n), cvxpy.Variable()
    given = {
        "J": cvxpy.Parameter((m, n)),
        "V": cvxpy.Parameter(m),
        "lo": cvxpy.Parameter(n),
        "hi": cvxpy.Parameter(n),
    }
    objective = alpha - rho / 2 * cvxpy.sum_squares(v) if rho > 0 else alpha
    constraints = [
        given["J"] @ v == alpha * given["V"],
        alpha >= 0,
        alpha <= 1,
        v >= given["lo"],
        v <= given["hi"],
    ]
    return cvxpy.Problem(cvxpy.Maximize(objective), constraints), (v, alpha), given
