"""The contract's clause on problems that a formulation does not support: it says so."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from typing import Final

import numpy as np

from dikbench.problem.problem import DikProblem, Formulation, promises_of
from dikbench.problem.tasks.task import LinearizedTask
from dikbench.simulation.status import Status
from dikbench.testing.asked import Asked, asked_of
from dikbench.testing.parameters import WRONG
from dikbench.testing.states import State, posed

APART_RAD_S: Final = 0.01
"""How far two rows G v <= h are from having a common point."""

ROWS_OF_THE_SECOND: Final = 2
ROWS_OF_A_PART: Final = 2

SLOWEST: Final = 1e-3
"""What is asked for at them is at least so fast [m/s, rad/s]."""

PLACES: Final = 3
"""States at which odd problems are posed."""


def check_refusals(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that problems which the formulation does not support are refused, and not answered.

    Posed are a part of a pose, two tasks of first priority, and, where rows G v <= h are promised,
    rows that contradict each other, which have no answer. `refuses` gives a text; what it refuses,
    `velocity` does not answer; a second task of first priority changes the answer, or is refused.
    """
    asked = asked_of(formulation, solver)
    refuses = getattr(asked.formulation, "refuses", None)
    listens = heard = False
    for what, state in _odd(asked):
        tasks = state.problem.tasks
        reason = "" if refuses is None else refuses(state.problem)
        if not isinstance(reason, str):
            raise AssertionError(f"{what}, {state.label}: refuses() gave {reason!r}; valid: a text")
        answer = asked.answer(state.problem)
        answered = answer.velocity is not None
        if reason:
            if answered:
                raise AssertionError(
                    f"{what}, {state.label}: refused ({reason}) and answered all the same; valid: "
                    "raise CannotAnswer"
                )
            continue
        if answer.status in WRONG:
            raise AssertionError(
                f"{what}, {state.label}: {answer.status.value}: {answer.message}; valid: an "
                "answer, or a reason in refuses() and CannotAnswer"
            )
        if what == CONTRADICTION and answered and answer.status is Status.OK:
            raise AssertionError(
                f"{what}, {state.label}: answered {answer.velocity}, though `keeps` promises "
                "inequalities and nothing keeps these; valid: raise Infeasible"
            )
        if what == TWO:
            alone = asked.velocity(_with(state.problem, [tasks[0]]))
            slower = copy(tasks[0])
            slower.V = 0.5 * slower.V
            listens |= not _same(alone, asked.velocity(_with(state.problem, [slower])))
            heard |= not _same(alone, answer.velocity)
    if listens and not heard:
        raise AssertionError(
            f"{TWO}: the second one changed no answer; valid: problem.primary, which has the rows "
            "of both, or a reason in refuses()"
        )


TWO: Final = "two tasks of first priority"
CONTRADICTION: Final = "rows G v <= h that contradict each other"


def _odd(asked: Asked) -> Iterator[tuple[str, State]]:
    """Yield problems of other kinds than the states of the contract, each with what is odd."""
    inside = [s for s in asked.states() if "(inside the limits" in s.label]
    states = [s for s in inside if np.linalg.norm(s.problem.tasks[0].V) > SLOWEST][:PLACES]
    for number, state in enumerate(states):
        problem, random = state.problem, np.random.default_rng(number)
        first = problem.tasks[0]
        robot = replace(problem.robot, task_rows=problem.robot.task_rows[:ROWS_OF_A_PART])
        twist = np.zeros(6)
        twist[list(robot.task_rows)] = first.V[:ROWS_OF_A_PART]
        yield "a part of a pose", State(state.label, posed(robot, problem.q, twist))
        n = problem.robot.nv
        J, V = random.normal(size=(ROWS_OF_THE_SECOND, n)), random.normal(size=ROWS_OF_THE_SECOND)
        second = LinearizedTask(J, V, problem.dt * V, first.weight, first.priority)
        yield TWO, State(state.label, _with(problem, [copy(first), second]))
        if "inequalities" in promises_of(asked.formulation):
            normal = random.normal(size=n)
            G = np.stack([normal, -normal]) / np.linalg.norm(normal)
            yield (
                CONTRADICTION,
                State(state.label, _with(problem, [copy(first)], G, np.full(2, -APART_RAD_S))),
            )


def _with(
    problem: DikProblem,
    tasks: list[LinearizedTask],
    G: np.ndarray | None = None,
    h: np.ndarray | None = None,
) -> DikProblem:
    p = problem
    return DikProblem(p.robot, p.q, p.v_prev, p.dt, tasks, p.limits, G=G, h=h)


def _same(v: np.ndarray | None, w: np.ndarray | None) -> bool:
    return v is w is None or (v is not None and w is not None and np.array_equal(v, w))
