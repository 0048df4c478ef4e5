"""The check that a formulation sees of a problem what it declares, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from types import MappingProxyType
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Formulation, ProblemPart, sight_of
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask
from dikbench.testing.asked import Asked, asked_of
from dikbench.testing.states import State, states

ROW_ROOM_RAD_S: Final = 0.01
"""How far from a standstill the added rows let the robot go."""

ADDED_ROWS: Final = 2
"""Rows of the constraint and of the task that are added."""


def _with_rows(problem: DikProblem, random: np.random.Generator) -> DikProblem:
    n = problem.robot.nv
    G = random.normal(size=(ADDED_ROWS, n))
    G /= np.linalg.norm(G, axis=1, keepdims=True)
    return _changed(problem, problem.tasks, G, np.full(ADDED_ROWS, ROW_ROOM_RAD_S))


def _with_posture(problem: DikProblem, random: np.random.Generator) -> DikProblem:
    n = problem.robot.nv
    error = random.normal(size=n)
    added = LinearizedJointTask(np.eye(n), 2.0 * error, error, 0.1, 2)
    return _changed(problem, (problem.tasks[0], added), None, None)


def _with_task(problem: DikProblem, random: np.random.Generator) -> DikProblem:
    n = problem.robot.nv
    J, V = random.normal(size=(ADDED_ROWS, n)), random.normal(size=ADDED_ROWS)
    added = LinearizedTask(J, V, np.zeros(ADDED_ROWS), 0.1, 2)
    return _changed(problem, (problem.tasks[0], added), None, None)


def _with_weights(problem: DikProblem, random: np.random.Generator) -> DikProblem:
    task = copy(problem.tasks[0])
    task.weight = random.uniform(0.1, 10.0, len(task.V))
    return _changed(problem, (task,), None, None)


Change = Callable[[DikProblem, np.random.Generator], DikProblem]

ADDED: Final[Mapping[str, tuple[Change, frozenset[ProblemPart]]]] = MappingProxyType(
    {
        "rows G v <= h": (_with_rows, frozenset({"inequalities"})),
        "a posture task below the first priority": (
            _with_posture,
            frozenset({"postures", "lower-tasks"}),
        ),
        "a task below the first priority": (_with_task, frozenset({"lower-tasks"})),
        "a weight of each row": (_with_weights, frozenset({"weights"})),
    }
)
"""What is added to problems, and which parts, any of which, declare that it is seen."""


def _changed(
    problem: DikProblem, tasks: Sequence[LinearizedTask], G: Array | None, h: Array | None
) -> DikProblem:
    p = problem
    return DikProblem(p.robot, p.q, p.v_prev, p.dt, tasks, p.limits, G=G, h=h)


def alone(states: Iterable[State]) -> list[State]:
    """Return the states with their first task alone, and without rows G v <= h."""
    return [State(s.label, _changed(s.problem, s.problem.tasks[:1], None, None)) for s in states]


def check_sight(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that what a formulation sees changes its answer somewhere, and nothing else does ever.

    Rows that it only promises to keep need change nothing. Each state is asked with one task, and
    with rows G v <= h, a posture task, another task of lower priority or weights in addition.
    """
    asked = asked_of(formulation, solver)
    seen = sight_of(asked.formulation)
    said = frozenset(getattr(asked.formulation, "sees", ()))
    bare = alone(states())
    without = [asked.velocity(problem) for _, problem in bare]
    for what, (change, declared) in ADDED.items():
        random, differs = np.random.default_rng(0), False
        for (label, problem), v in zip(bare, without, strict=True):
            w = asked.velocity(change(problem, random))
            same = v is w is None or (v is not None and w is not None and np.array_equal(v, w))
            differs |= not same
            if not same and not declared & seen:
                raise AssertionError(
                    f"{label}: {what} changed the answer, which `sees` does not declare"
                )
        if declared & said and not differs:
            raise AssertionError(f"`sees` declares {what}, which changed no answer")
