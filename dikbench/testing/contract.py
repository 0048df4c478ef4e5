"""The contract of formulations, as checks for the author of a plug-in.

    @pytest.mark.parametrize("check", dikbench.testing.CHECKS)
    def test_contract(check):
        check(MyLaw(), None)

or, without pytest, `check_formulation(MyLaw())`. A check that fails raises `AssertionError` with
the robot, the state and what was violated. The states are the same in every run: three arms inside,
at and outside their limits and at exact singularities, with a zero, an ordinary and a very large
desired twist, with and without a posture task, acceleration limits, rows G v <= h and a previous
velocity.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Final, get_args

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.problem import (
    DikProblem,
    Formulation,
    LimitKind,
    ProblemPart,
    program_of,
    promises_of,
    sight_of,
)
from dikbench.programs.quadratic_program import ProgramKind
from dikbench.simulation.status import Status
from dikbench.testing.asked import LIMIT_TOLERANCE_RAD_S, Asked, asked_of
from dikbench.testing.direction import check_direction
from dikbench.testing.memory import check_memory
from dikbench.testing.parameters import check_ranges
from dikbench.testing.priority import check_priority
from dikbench.testing.refusals import check_refusals
from dikbench.testing.rows import check_rows
from dikbench.testing.sight import check_sight
from dikbench.testing.states import State

Check = Callable[[Formulation | Asked, str | None], None]


def check_declaration(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the formulation is a frozen dataclass and that what it declares exists."""
    formulation = formulation.formulation if isinstance(formulation, Asked) else formulation
    name = type(formulation).__name__
    parameters = getattr(formulation, "__dataclass_params__", None)
    if isinstance(formulation, type) or not is_dataclass(formulation) or not parameters.frozen:
        raise AssertionError(f"{name} is not an instance of a class with @dataclass(frozen=True)")
    if program_of(formulation) not in {None, *get_args(ProgramKind)}:
        valid = ", ".join(get_args(ProgramKind))
        raise AssertionError(f"{name}.program is {program_of(formulation)!r}; valid: None, {valid}")
    wrong = promises_of(formulation) - set(get_args(LimitKind))
    if wrong:
        valid = ", ".join(get_args(LimitKind))
        raise AssertionError(f"{name}.keeps holds {sorted(wrong)}; valid: {valid}")
    strange = sight_of(formulation) - set(get_args(ProblemPart))
    if strange:
        valid = ", ".join(get_args(ProblemPart))
        raise AssertionError(f"{name}.sees holds {sorted(strange)}; valid: {valid}")


def check_raises_only_cannot_answer(
    formulation: Formulation | Asked, solver: str | None = None
) -> None:
    """Check that the formulation answers or raises `CannotAnswer`, and answers somewhere."""
    asked = asked_of(formulation, solver)
    for state, answer in asked.answers:
        if answer.status is Status.FORMULATION_ERROR:
            raise AssertionError(f"{state.label}: raised {answer.message}")
    for _ in asked.verified():
        break


def check_shape(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the velocity is an array of nv floats."""
    asked = asked_of(formulation, solver)
    for state, answer in asked.answers:
        if answer.status is Status.WRONG_SHAPE:
            raise AssertionError(f"{state.label}: wrong shape: {answer.message}")
        if answer.velocity is not None and answer.velocity.dtype != np.float64:
            raise AssertionError(f"{state.label}: expected floats, got {answer.velocity.dtype}")


def check_finite(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the velocity holds neither NaN nor infinity."""
    asked = asked_of(formulation, solver)
    for state, answer in asked.answers:
        if answer.status is Status.NOT_FINITE:
            raise AssertionError(f"{state.label}: not finite: {answer.message}")


def check_inputs_untouched(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the formulation leaves everything that it was handed as it was."""
    asked = asked_of(formulation, solver)
    for state in asked.states():
        before = {name: np.array(value) for name, value in _inputs(state.problem).items()}
        asked.velocity(state.problem)
        after = _inputs(state.problem)
        for name in before.keys() | after.keys():
            if name not in before or name not in after:
                raise AssertionError(f"{state.label}: the formulation replaced problem.{name}")
            if not np.array_equal(before[name], np.asarray(after[name])):
                raise AssertionError(f"{state.label}: the formulation changed problem.{name}")


def _inputs(problem: DikProblem) -> dict[str, Array | float]:
    """List the inputs of a formulation by their names."""
    found: dict[str, Array | float | None] = {
        "q": problem.q,
        "v_prev": problem.v_prev,
        "dt": problem.dt,
        "limits.to_lower": problem.limits.to_lower,
        "limits.to_upper": problem.limits.to_upper,
        "limits.coordinates": problem.limits.coordinates,
        "robot.q0": problem.robot.q0,
        "robot.available_acceleration": problem.robot.available_acceleration,
        "robot.model.lowerPositionLimit": problem.robot.model.lowerPositionLimit,
        "robot.model.upperPositionLimit": problem.robot.model.upperPositionLimit,
        "robot.model.velocityLimit": problem.robot.model.velocityLimit,
        "G": problem.G,
        "h": problem.h,
    }
    for number, task in enumerate(problem.tasks):
        for name in ("J", "V", "error", "weight", "priority"):
            found[f"tasks[{number}].{name}"] = getattr(task, name)
    for kind in ("position", "velocity", "acceleration", "effort"):
        interval = getattr(problem.limits.joint, kind)
        if interval is not None:
            found[f"limits.joint.{kind}.lower"] = interval.lower
            found[f"limits.joint.{kind}.upper"] = interval.upper
    return {name: value for name, value in found.items() if value is not None}


def check_repeatable(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the same problem gives the same velocity to the bit, whatever came in between."""
    asked = asked_of(formulation, solver)
    _compare(asked, asked, "asked again")


def check_picklable(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check that the formulation can be pickled, and that the copy gives the same velocities."""
    asked = asked_of(formulation, solver)
    try:
        unpickled = pickle.loads(pickle.dumps(asked.formulation))
    except Exception as error:
        raise AssertionError(
            f"{type(asked.formulation).__name__} cannot be pickled ({error}); workers are "
            "processes: define the class at the top of a module, with parameters that pickle"
        ) from error
    _compare(asked, Asked(unpickled, asked.selector), "unpickled")


def _compare(first: Asked, second: Asked, what: str) -> None:
    """Ask one forwards through the states, the other backwards, with other scratch data."""
    for state, (_, answer) in reversed([*zip(first.states(), first.answers, strict=True)]):
        v = answer.velocity
        robot = state.problem.robot
        pin.computeJointJacobians(robot.model, robot.scratch, robot.q0)
        w = second.velocity(state.problem)
        if v is w is None or (v is not None and w is not None and np.array_equal(v, w)):
            continue
        raise AssertionError(f"{state.label}: gave {v}, {what} {w}")


def check_position_limits(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where promised, that q + v dt is inside the position limits, or no further out."""
    _check_promise("position", formulation, solver)


def check_velocity_limits(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where promised, that v is inside the velocity limits."""
    _check_promise("velocity", formulation, solver)


def check_acceleration_limits(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where promised and not relaxed, that (v - v_prev)/dt is inside the limits."""
    _check_promise("acceleration", formulation, solver)


def check_inequalities(formulation: Formulation | Asked, solver: str | None = None) -> None:
    """Check, where promised, that G v <= h at states where the formulation has an answer."""
    _check_promise("inequalities", formulation, solver)


def _check_promise(kind: LimitKind, formulation: Formulation | Asked, solver: str | None) -> None:
    asked = asked_of(formulation, solver)
    if kind in promises_of(asked.formulation):
        for state, v, tolerance in asked.verified():
            assert_within(state, kind, v, tolerance)


def _allowed(problem: DikProblem, kind: LimitKind) -> tuple[Array, Array] | None:
    """Compute what a kind of limit allows, two arrays (nv,); None where it is not in force."""
    limits, dt = problem.limits, problem.dt
    if kind == "position":
        if limits.to_lower is None or limits.to_upper is None:
            return None
        return -np.maximum(limits.to_lower, 0) / dt, np.maximum(limits.to_upper, 0) / dt
    if kind == "velocity":
        velocity = limits.joint.velocity
        return None if velocity is None else (velocity.lower, velocity.upper)
    acceleration, v_prev = limits.joint.acceleration, problem.v_prev
    if acceleration is None or v_prev is None or problem.relaxed:
        return None
    return v_prev + acceleration.lower * dt, v_prev + acceleration.upper * dt


def assert_within(state: State, kind: LimitKind, v: Array, tolerance: float) -> None:
    """Assert that a velocity (nv,) keeps one kind of limits at a state, to a tolerance [rad/s]."""
    if kind == "inequalities":
        _assert_inequalities(state, v, tolerance)
        return
    allowed = _allowed(state.problem, kind)
    if allowed is None:
        return
    lower, upper = allowed
    excess = np.maximum(lower - v, v - upper)
    worst = int(np.argmax(excess))
    if excess[worst] > tolerance:
        raise AssertionError(
            f"{state.label}: joint {worst} passes its {kind} limit: {v[worst]:.9g} rad/s, allowed "
            f"from {lower[worst]:.9g} to {upper[worst]:.9g}"
        )


def _assert_inequalities(state: State, v: Array, tolerance: float) -> None:
    G, h = state.problem.G, state.problem.h
    if G is None or h is None:
        return
    excess = G @ v - h
    worst = int(np.argmax(excess))
    if excess[worst] > tolerance:
        raise AssertionError(
            f"{state.label}: row {worst} of G v <= h is passed by {excess[worst]:.9g} rad/s"
        )


def check_state(formulation: Formulation, state: State, solver: str | None = None) -> None:
    """Check one state: a velocity inside the promised limits, or `CannotAnswer`.

    For property-based tests; an answer that fails the recheck is not checked.

    Raises:
        AssertionError: if the formulation raises, answers with a wrong shape or NaN, or breaks a
            promise.
    """
    answer = Asked(formulation, solver).answer(state.problem)
    if answer.status in {Status.FORMULATION_ERROR, Status.WRONG_SHAPE, Status.NOT_FINITE}:
        raise AssertionError(f"{state.label}: {answer.status.value}: {answer.message}")
    if answer.velocity is not None and answer.status is Status.OK:
        for kind in promises_of(formulation):
            assert_within(state, kind, answer.velocity, LIMIT_TOLERANCE_RAD_S + answer.residual)


CHECKS: Final[tuple[Check, ...]] = (
    check_declaration,
    check_ranges,
    check_sight,
    check_raises_only_cannot_answer,
    check_shape,
    check_finite,
    check_direction,
    check_inputs_untouched,
    check_repeatable,
    check_memory,
    check_picklable,
    check_position_limits,
    check_velocity_limits,
    check_acceleration_limits,
    check_inequalities,
    check_priority,
    check_refusals,
    check_rows,
)
"""Every check: (formulation, solver's selector or None for the default) -> None.

An `Asked` instead of the formulation is asked once for all of them."""


def check_formulation(formulation: Formulation, solver: str | None = None) -> None:
    """Run every check on a formulation.

    Args:
        formulation: the formulation, with its parameters set.
        solver: a solver's selector; default: the default one for its program.

    Raises:
        AssertionError: if the formulation breaks its contract.
        DikbenchError: if the solver is unknown or cannot take what the formulation needs solved.
    """
    check_declaration(formulation, solver)
    asked = Asked(formulation, solver)
    for check in CHECKS:
        check(asked, None)
