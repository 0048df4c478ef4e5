"""The contract's clause on memory: an answer depends on the problem alone, and stays as it was."""

from __future__ import annotations

from copy import copy
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Formulation
from dikbench.testing.asked import Asked, asked_of
from dikbench.testing.states import State

NEIGHBOURS: Final = 6
"""Problems that follow each other, as control steps do."""

STEP: Final = 1e-5
"""By how much each differs from the one before: in q [rad or m], and in V as a share of it."""

OFTEN: Final = 50
"""So often the same problem is asked in a row."""

SLOWEST: Final = 1e-3
"""What is asked for at them is at least so fast [m/s, rad/s]."""

FAR: Final = 1e-2
"""By what share of V a problem differs that nobody takes for the same."""

PLACES: Final = 2
"""States at which all this is done."""


def check_memory(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that answers do not depend on those before, nor change after they were given.

    Problems that differ little, as control steps do, are asked forwards and backwards; one problem
    is asked many times. A warm start, a filter, a cache that takes what is near for the same, and
    an answer that drifts all give other bits.
    """
    asked = asked_of(formulation, solver)
    states = [s for s in asked.states() if np.linalg.norm(s.problem.tasks[0].V) > SLOWEST]
    responds = stale = 0
    for state in states[:: max(1, len(states) // PLACES)][:PLACES]:
        problems = [_near(state.problem, k) for k in range(NEIGHBOURS)]
        given = [asked.velocity_itself(problem) for problem in problems]
        kept = [None if v is None else np.array(v) for v in given]
        for k in reversed(range(NEIGHBOURS)):
            again = asked.velocity(problems[k])
            if not _same(kept[k], again):
                raise AssertionError(
                    f"{state.label}: asked after problems nearby gave {kept[k]}, in another order "
                    f"{again}: something of the problems before is remembered (a warm start, a "
                    "filter, a cache)"
                )
        _assert_unchanged(state, given, kept)
        if not _same(kept[0], asked.velocity(_near(state.problem, FAR / STEP))):
            responds += 1
            stale += _same(kept[0], asked.velocity(_near(state.problem, 1.5)))
        for count in range(1, OFTEN + 1):
            again = asked.velocity(problems[0])
            if not _same(kept[0], again):
                raise AssertionError(
                    f"{state.label}: gave {kept[0]}, asked {count} times more {again}: the answer "
                    "drifts"
                )

    if 0 < responds == stale:
        raise AssertionError(
            f"{STEP:g} of the twist that is asked for changes no bit of an answer, {FAR:g} of it "
            "does: what is near is taken for the same"
        )


def _assert_unchanged(state: State, given: list[Array | None], kept: list[Array | None]) -> None:
    """Assert that nobody wrote into the arrays that were returned."""
    for v, copied in zip(given, kept, strict=True):
        if not _same(copied, v):
            raise AssertionError(
                f"{state.label}: gave {copied}, which later calls overwrote with {v}: return an "
                "array of its own each time"
            )


def _same(v: Array | None, w: Array | None) -> bool:
    return v is w is None or (v is not None and w is not None and np.array_equal(v, w, True))


def _near(problem: DikProblem, k: float) -> DikProblem:
    """Return a problem that is k steps from another one."""
    p, tasks = problem, [copy(task) for task in problem.tasks]
    for task in tasks:
        task.V = task.V * (1 + k * STEP)
    robot = p.robot
    q = p.q if robot.nq != robot.nv else p.q + k * STEP * np.cos(np.arange(robot.nq))
    return DikProblem(robot, q, p.v_prev, p.dt, tasks, p.limits, G=p.G, h=p.h)
