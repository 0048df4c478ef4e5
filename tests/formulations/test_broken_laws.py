"""Laws with one defect each, which the contract finds."""

from __future__ import annotations

import typing
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from makers.few_states import few_states

from dikbench.arrays import Array
from dikbench.errors import Infeasible
from dikbench.problem import DikProblem, Formulation, LimitKind, Solve
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.testing import (
    CHECKS,
    Asked,
    check_formulation,
)


@dataclass(frozen=True)
class Still:
    """A law that stands still, and with that keeps two kinds of limits."""

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv)


@dataclass(frozen=True)
class ScalesJacobianInPlace(Still):
    """Writes into the task's Jacobian."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        problem.tasks[0].J *= 2
        return super().velocity(problem, solve)


@dataclass(frozen=True)
class TightensLimitsInPlace(Still):
    """Writes into the robot's velocity limits."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        assert problem.limits.joint.velocity is not None
        problem.limits.joint.velocity.upper[0] *= 0.98
        return super().velocity(problem, solve)


@dataclass(frozen=True)
class DropsTasks(Still):
    """Replaces the list of tasks."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        problem.tasks = problem.tasks[:1]
        return super().velocity(problem, solve)


@dataclass(frozen=True)
class ReturnsColumn(Still):
    """Returns a matrix of one column."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros((problem.robot.nv, 1))


@dataclass(frozen=True)
class ReturnsSinglePrecision(Still):
    """Returns floats of half the size."""

    def velocity(self, problem: DikProblem, solve: Solve) -> typing.Any:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv, dtype=np.float32)


@dataclass(frozen=True)
class NormalisesZero(Still):
    """Divides by the length of the wanted twist, which may be zero."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        V = problem.primary.V
        with np.errstate(invalid="ignore"):
            return 1e-9 * problem.primary.J.T @ (V / np.linalg.norm(V))


@dataclass(frozen=True)
class RaisesValueError(Still):
    """Raises where the wanted twist is zero."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        if not problem.tasks[0].V.any():
            raise ValueError("no direction")
        return super().velocity(problem, solve)


@dataclass(frozen=True)
class SolvesUndeclared(Still):
    """Calls a solver although it declares no program."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        n = problem.robot.nv
        return solve(QuadraticProgram(np.eye(n), np.zeros(n)))


@dataclass(frozen=True)
class NeverAnswers(Still):
    """Has no answer anywhere."""

    keeps: ClassVar[frozenset[LimitKind]] = frozenset()

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        raise Infeasible("never")


@dataclass(frozen=True)
class ThrowsDice(Still):
    """Depends on a random number."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return 1e-9 * np.random.default_rng().uniform(-1, 1, problem.robot.nv)


@dataclass(frozen=True)
class Remembers(Still):
    """Depends on how often it was asked."""

    asked: ClassVar[list[int]] = []

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        self.asked.append(1)
        return np.full(problem.robot.nv, 1e-12 * len(self.asked))


@dataclass(frozen=True)
class ReadsLeftovers(Still):
    """Reads scratch data that it did not compute."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        J = problem.robot.scratch.J
        return np.full(problem.robot.nv, 1e-9 * float(np.abs(J).sum()))


@dataclass(frozen=True)
class HoldsLambda(Still):
    """Has a parameter that cannot be pickled."""

    transform: Callable[[Array], Array] = lambda v: v


@dataclass(frozen=True)
class PromisesVelocity:
    """Promises the velocity limits and does nothing for it."""

    keeps: ClassVar[frozenset[str]] = frozenset({"velocity"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        v: Array = np.linalg.pinv(task.J, rcond=1e-6) @ task.V
        return v


@dataclass(frozen=True)
class PromisesPosition(PromisesVelocity):
    """Promises the position limits and does nothing for it."""

    keeps: ClassVar[frozenset[str]] = frozenset({"position"})


@dataclass(frozen=True)
class PromisesAcceleration(PromisesVelocity):
    """Promises the acceleration limits and does nothing for it."""

    keeps: ClassVar[frozenset[str]] = frozenset({"acceleration"})


@dataclass(frozen=True)
class LeavesFurther(PromisesVelocity):
    """Stops before a position limit, but runs away once it is outside."""

    keeps: ClassVar[frozenset[str]] = frozenset({"position"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        lower, upper = problem.limits.to_lower, problem.limits.to_upper
        assert lower is not None
        assert upper is not None
        hi = np.where(upper < 0, np.inf, upper / problem.dt)
        lo = np.where(lower < 0, -np.inf, -lower / problem.dt)
        return np.clip(super().velocity(problem, solve), lo, hi)


@dataclass
class NotFrozen:
    """Is not frozen."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv)


@dataclass(frozen=True)
class PromisesTorque(PromisesVelocity):
    """Promises a kind of limit that there is not."""

    keeps: ClassVar[frozenset[str]] = frozenset({"torque"})


@dataclass(frozen=True)
class NeedsUnknownProgram(Still):
    """Declares a kind of program that there is not."""

    program: ClassVar[str] = "sdp"


FORGETFUL = {"check_repeatable", "check_picklable"}  # both compare two sweeps


BROKEN: list[tuple[typing.Any, set[str]]] = [
    (ScalesJacobianInPlace(), {"check_inputs_untouched"}),
    (TightensLimitsInPlace(), {"check_inputs_untouched"}),
    (DropsTasks(), {"check_inputs_untouched"}),
    (ReturnsSinglePrecision(), {"check_shape"}),
    (NormalisesZero(), {"check_finite"}),
    (RaisesValueError(), {"check_raises_only_cannot_answer"}),
    (NeverAnswers(), {"check_raises_only_cannot_answer"}),
    # Whatever is added, the answer is another one.
    (ThrowsDice(), FORGETFUL | {"check_memory", "check_sight"}),
    (Remembers(), FORGETFUL | {"check_memory", "check_sight"}),
    (ReadsLeftovers(), FORGETFUL),
    (HoldsLambda(), {"check_picklable"}),
    (PromisesVelocity(), {"check_velocity_limits"}),
    (PromisesPosition(), {"check_position_limits"}),
    (LeavesFurther(), {"check_position_limits"}),
    (PromisesAcceleration(), {"check_acceleration_limits"}),
    (NotFrozen(), {"check_declaration"}),
    (PromisesTorque(), {"check_declaration"}),
]


def failing(law: Formulation) -> set[str]:
    """Names of the checks that a law fails, asked at one state in so many."""
    names, once = set(), Asked(law)
    with few_states(0):
        for check in CHECKS:
            try:
                check(once, None)
            except AssertionError:
                names.add(check.__name__)
    return names


@pytest.mark.parametrize(("law", "expected"), BROKEN, ids=[type(law).__name__ for law, _ in BROKEN])
def test_broken_law_fails_its_check_alone(law: Formulation, expected: set[str]) -> None:
    """A law with one defect fails the check for that defect, and no other."""
    assert failing(law) == expected


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (ReturnsColumn(), "check_shape"),
        (SolvesUndeclared(), "check_raises_only_cannot_answer"),
    ],
)
def test_law_that_never_answers_properly_fails(law: Formulation, expected: str) -> None:
    """A law whose every answer is wrong fails the check that says why."""
    assert expected in failing(law)


def test_unknown_program_is_named() -> None:
    """A program that there is not is found before any solver is looked for."""
    with pytest.raises(AssertionError, match=r"sdp.*valid: None, qp, lp, cvxpy"):
        check_formulation(NeedsUnknownProgram())


def test_sound_law_passes() -> None:
    """The law from which the broken ones are made keeps the contract."""
    check_formulation(Still())


def test_failure_names_robot_state_and_limit() -> None:
    """The message of a failed check names the robot, the state, the joint and the limit."""
    with pytest.raises(
        AssertionError,
        match=r"panda, state \d+ \(.* m/s.*\): joint \d passes its velocity limit: .* allowed",
    ):
        check_formulation(PromisesVelocity())
