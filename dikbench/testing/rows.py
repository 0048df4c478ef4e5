"""The promise of formulations that answer many control steps at once: rows never meet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Formulation, is_batched
from dikbench.problem.tasks.task import LinearizedJointTask, LinearizedTask
from dikbench.robots.limits import Limits
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.many_solve import ManySolve
from dikbench.testing.asked import Answer, Asked, asked_of
from dikbench.testing.states import State

ROW_TOLERANCE: Final = 1e-9
"""Largest difference of a row's answer from the one to it alone, times 1 + |v| [rad/s]."""


def check_rows(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where `batched` is declared, that each of many control steps is answered as if alone.

    The answers are those to each step alone, to `ROW_TOLERANCE`, or NaN, and the same to the bit in
    another order and among other steps.
    """
    asked = asked_of(formulation, solver)
    if not is_batched(asked.formulation):
        return
    answered = False
    for group in _groups(asked.answers):
        labels = [state.label for state, _ in group]
        problems = [state.problem for state, _ in group]
        together = _ask(asked, problems, labels)
        for order in (range(len(group))[::-1], range(0, len(group), 2), range(1)):
            others = _ask(asked, [problems[k] for k in order], [labels[k] for k in order])
            for row, k in enumerate(order):
                if not np.array_equal(others[row], together[k], equal_nan=True):
                    raise AssertionError(
                        f"{labels[k]}: as one of {len(problems)} rows gave {together[k]}, as one "
                        f"of {len(order)} {others[row]}: rows must not meet (reduce over the last "
                        "axis)"
                    )
        for (state, answer), row in zip(group, together, strict=True):
            v = answer.velocity
            if not np.isfinite(row).all():
                continue
            if v is None:
                raise AssertionError(
                    f"{state.label}: alone {answer.status.value}, as one of many {row}: give NaN "
                    "where there is no answer"
                )
            answered = True
            if answer.status is Status.OK and np.abs(row - v).max() > ROW_TOLERANCE * (
                1 + np.abs(v).max()
            ):
                raise AssertionError(f"{state.label}: alone gave {v}, as one of many {row}")
    if not answered:
        raise AssertionError(
            f"{type(asked.formulation).__name__} is batched and answered no row of many; where it "
            "cannot, leave `batched` out"
        )


def _groups(answers: Sequence[tuple[State, Answer]]) -> list[list[tuple[State, Answer]]]:
    """Group states of one robot that can be posed at once."""
    groups: dict[tuple[object, ...], list[tuple[State, Answer]]] = {}
    for state, answer in answers:
        problem = state.problem
        if problem.G is None:
            key = (
                problem.robot.name,
                problem.limits.joint.acceleration is None,
                problem.v_prev is None,
                len(problem.tasks),
            )
            groups.setdefault(key, []).append((state, answer))
    return list(groups.values())


def _ask(asked: Asked, problems: Sequence[DikProblem], labels: Sequence[str]) -> Array:
    """Ask for control steps at once, (N, nv)."""
    many = ManySolve(guesses=asked.selector is None)  # a solver that is named is asked always
    many.begin_step([make_solve(asked.solver, asked.program) for _ in problems])
    posed = posed_together(problems)
    try:
        v = asked.formulation.velocity(posed, many)
    except Exception as error:
        raise AssertionError(
            f"{labels[0]} and {len(problems) - 1} others at once: raised {type(error).__name__}: "
            f"{error}"
        ) from error
    shape = (len(problems), posed.robot.nv)
    if not isinstance(v, np.ndarray) or v.shape != shape or v.dtype != float:
        got = getattr(v, "shape", type(v).__name__)
        raise AssertionError(f"{labels[0]} and others at once: expected {shape} floats, got {got}")
    return v


def posed_together(problems: Sequence[DikProblem]) -> DikProblem:
    """Pose control steps of one robot at once (see `DikProblem`), read-only."""
    first = problems[0]
    tasks = [_stacked([problem.tasks[n] for problem in problems]) for n in range(len(first.tasks))]
    coordinates = (
        None
        if first.limits.coordinates is None
        else np.array([problem.limits.coordinates for problem in problems])
    )
    v_prev = None if first.v_prev is None else np.array([problem.v_prev for problem in problems])
    q = np.array([problem.q for problem in problems])
    for part in (q, v_prev, *(x for task in tasks for x in (task.J, task.V, task.error))):
        if part is not None:
            part.setflags(write=False)
    limits = Limits(first.limits.joint, coordinates)
    return DikProblem(first.robot, q, v_prev, first.dt, tasks, limits)


def _stacked(tasks: Sequence[LinearizedTask]) -> LinearizedTask:
    first = tasks[0]
    V, error = np.array([task.V for task in tasks]), np.array([task.error for task in tasks])
    if isinstance(first, LinearizedJointTask):
        return LinearizedJointTask(first.J, V, error, first.weight, first.priority)
    J = np.array([task.J for task in tasks])
    return LinearizedTask(J, V, error, first.weight, first.priority)
