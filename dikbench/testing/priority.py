"""The promise of strict priorities: what is asked for below the first one costs it nothing."""

from __future__ import annotations

import numpy as np

from dikbench.problem.problem import Formulation, is_strict
from dikbench.testing.asked import LIMIT_TOLERANCE_RAD_S, Asked, asked_of
from dikbench.testing.sight import ADDED, alone


def check_priority(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where `strict` promises it, that lower tasks leave the first priority as it is.

    ||J_1 (v - v_alone)|| is at most the tolerance of a limit and the residuals of the solver, with
    a posture task and another task below the first priority.
    """
    asked = asked_of(formulation, solver)
    if not is_strict(asked.formulation):
        return
    for what, (change, declared) in ADDED.items():
        if "lower-tasks" not in declared:
            continue
        random = np.random.default_rng(0)
        for label, problem in alone(asked.states()):
            one, both = asked.answer(problem), asked.answer(change(problem, random))
            if one.velocity is None or both.velocity is None:
                continue
            J = problem.tasks[0].J
            leak = float(np.linalg.norm(J @ (both.velocity - one.velocity)))
            scale = max(1.0, float(np.linalg.norm(J)))
            if leak > scale * (LIMIT_TOLERANCE_RAD_S + one.residual + both.residual):
                raise AssertionError(
                    f"{label}: {what} changes what the first priority gets by {leak:.4g} m/s, "
                    "rad/s, though `strict` promises that none does"
                )
