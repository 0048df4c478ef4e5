"""The contract's clause on the frame: the motion is not away from the one that is asked for."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.problem.problem import Formulation
from dikbench.testing.asked import Asked, asked_of
from dikbench.testing.states import posed

DIRECTIONS: Final = 4
"""Random twists at each configuration inside the limits."""

SLOW: Final = 0.03
"""Their length [m/s, rad/s], so that no limit is in the way."""

STILL: Final = 1e-6
"""A motion of the frame shorter than this [m/s, rad/s] has no direction."""


def check_direction(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the frame moves towards the twist that is asked for: V^T J (v - v_0) >= 0.

    v_0 is the answer where no motion is asked for. J and V are body twists of the task frame, the
    linear part first. A formulation that takes V for a twist in another frame, exchanges its parts
    or has a sign wrong moves away from it somewhere.
    """
    asked = asked_of(formulation, solver)
    random = np.random.default_rng(0)
    for state in asked.states():
        if "(inside the limits" not in state.label:
            continue
        robot = state.problem.robot.with_limits(acceleration=None)
        rows = list(robot.task_rows)
        at_rest = asked.velocity(posed(robot, state.problem.q, np.zeros(6)))
        if at_rest is None:
            continue
        for _ in range(DIRECTIONS):
            twist = np.zeros(6)
            twist[rows] = random.normal(size=len(rows))
            problem = posed(robot, state.problem.q, SLOW * twist / float(np.linalg.norm(twist)))
            v, task = asked.velocity(problem), problem.tasks[0]
            if v is None:
                continue
            moved = task.J @ (v - at_rest)
            if float(np.linalg.norm(moved)) > STILL and float(task.V @ moved) < 0:
                raise AssertionError(
                    f"{state.label}: asked for the twist {task.V}, the frame moves away from it: "
                    f"J (v - v_0) = {moved} (J and V are body twists of the task frame, "
                    "linear part first)"
                )
