"""Every law keeps the limits that it promises to keep, at states that hypothesis makes up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import HealthCheck, find, given, settings
from hypothesis import strategies as st
from makers.problems import equation, kinematics_at, problem_at

from dikbench import PostureTask, load_robot
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import plugins
from dikbench.problem import DikProblem, Formulation, LimitKind, Solve, program_of
from dikbench.problem.velocity_box import velocity_box
from dikbench.testing import check_state
from dikbench.testing.states import SINGULAR, State

LAWS = [
    name for name in sorted(plugins("formulation")) if program_of(make_formulation(name)) is None
]
LAWS += ["pinv[after=clip]", "pinv[after=scale]", "dls[damping=0]", "nullspace[damping=0.05]"]
LAWS += ["qp", "qp[braking=gain]", "qp[braking=one-step]", "qp[braking=sqrt]", "lp-alpha"]
LAWS += ["sns[braking=one-step]", "sns[braking=sqrt]"]

FAST = settings(
    deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow], database=None
)
THOROUGH = settings(FAST, max_examples=5000)

NEAR = (0.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-15, 0.05, 0.4)
"""Distances from a position limit [rad], inside or outside."""


@st.composite
def states(draw: st.DrawFn) -> State:
    """A control step: in the middle and at rest if it is simple, adversarial if it is not."""
    name = draw(st.sampled_from(["planar3r", "ur5", "panda"]))
    robot = load_robot(name)
    n, position, velocity = robot.nv, robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    kinds = {
        "velocity": draw(st.sampled_from(["own", "lopsided", "one-way", "none"])),
        "acceleration": draw(st.sampled_from(["none", "own", "lopsided", "weak", "zero"])),
    }
    fastest, strongest = velocity.upper, robot.available_acceleration
    assert strongest is not None
    robot = robot.with_limits(
        velocity={
            "own": (velocity.lower, fastest),
            "lopsided": (-0.1 * fastest, 0.7 * fastest),
            "one-way": (-np.where(np.arange(n) % 2, 0.0, fastest), fastest),
            "none": None,
        }[kinds["velocity"]],
        acceleration={
            "none": None,
            "own": strongest,
            "lopsided": (-2.0 * strongest, 0.3 * strongest),
            "weak": 1e-3,
            "zero": 0.0,
        }[kinds["acceleration"]],
    )
    middle = np.clip((position.lower + position.upper) / 2, -3, 3)
    place = draw(st.sampled_from(["inside", "about the limits", "singular", "nearly singular"]))
    if place == "inside":
        share = np.array(draw(_vector(n, st.floats(-1, 1))))
        q = np.clip(
            middle + share * (position.upper - position.lower) / 2, position.lower, position.upper
        )
    elif place == "about the limits":
        q = np.array(
            [draw(_about(middle[i], position.lower[i], position.upper[i])) for i in range(n)]
        )
    else:
        q = np.array(draw(st.sampled_from(SINGULAR[name])), dtype=float)
        if place == "nearly singular":
            q = q + draw(st.sampled_from([1e-3, 1e-5, 1e-6, 1e-7, 1e-9])) * np.cos(np.arange(n))
    size = draw(st.sampled_from([0.0, 0.3, 10.0, 1e-3, 1e-9, 1e6, 1e-300]))
    rows = len(robot.task_rows)
    V = size * np.array(draw(_vector(rows, st.floats(-1, 1))))
    before = draw(st.sampled_from(["unknown", "at rest", "any", "at the bound", "too fast"]))
    v_prev = None
    if before != "unknown":
        side = {"at rest": st.just(0.0), "any": st.floats(-1, 1)}.get(
            before, st.sampled_from([1.0, -1.0, 0.0])
        )
        v_prev = (1.5 if before == "too fast" else 1.0) * fastest * np.array(draw(_vector(n, side)))
    dt = draw(st.sampled_from([0.01, 1e-3, 0.1]))
    kinematics = kinematics_at(robot, q)
    J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
    tasks = [equation(J, V)]
    posture = draw(st.booleans())
    if posture:
        tasks.append(PostureTask(robot.q0, gain=1 / dt).linearize(kinematics))
    label = f"{name}, {place}, limits {kinds}, |V| <= {size:g}, before {before}, dt {dt}"
    label += f", posture {posture}, q {q.tolist()}, v_prev {v_prev}, V {V.tolist()}"
    problem = problem_at(robot, q, tasks, v_prev, dt)
    if draw(st.booleans()):
        problem.G, problem.h = draw(_half_spaces(problem))
        label += f", G {problem.G.tolist()}, h {problem.h.tolist()}"
    return State(label, problem)


@st.composite
def _half_spaces(draw: st.DrawFn, problem: DikProblem) -> tuple[Any, Any]:
    """Rows of unit length, some of zeros, about the nearest velocity to rest in the box."""
    n = problem.robot.nv
    box = velocity_box(problem.limits, problem.v_prev, problem.dt)
    inside = np.clip(np.zeros(n), box.lower, box.upper)
    G = np.array(draw(_vector(2 * n, st.sampled_from([0.0, 1.0, -1.0, 0.3])))).reshape(2, n)
    length = np.linalg.norm(G, axis=1, keepdims=True)
    G = np.divide(G, length, out=G, where=length > 0)
    room = draw(st.sampled_from([0.0, 1e-6, 0.1, 10.0]))
    return G, G @ inside + room


def _vector(n: int, elements: st.SearchStrategy[float]) -> st.SearchStrategy[list[float]]:
    return st.lists(elements, min_size=n, max_size=n)


def _about(middle: float, lower: float, upper: float) -> st.SearchStrategy[float]:
    """In the middle, or a hair or more from one of the limits, on either side of it."""
    beside = [limit + sign * far for far in NEAR for sign in (-1, 1) for limit in (lower, upper)]
    return st.sampled_from([middle, *beside])


def property_of(profile: settings) -> Callable[[Formulation], None]:
    """The property that a law keeps its promises, as a function of the law."""

    def keeps_its_promises(law: Formulation) -> None:
        @profile
        @given(state=states())
        def holds(state: State) -> None:
            check_state(law, state)

        holds()

    return keeps_its_promises


@pytest.mark.parametrize("selector", LAWS)
def test_law_keeps_its_promises(selector: str) -> None:
    """A velocity inside the promised limits, or no answer: at, near and beyond every limit.

    At exact singularities, for zero and huge twists, whatever the motion before.
    """
    property_of(FAST)(make_formulation(selector))


@pytest.mark.long
@pytest.mark.parametrize("selector", LAWS)
def test_law_keeps_its_promises_at_thousands_of_states(selector: str) -> None:
    """The same, 5000 times."""
    property_of(THOROUGH)(make_formulation(selector))


@dataclass(frozen=True)
class Lying:
    """Promises everything, and keeps it but for one lie; `lie` spoils the box, (lower, upper)."""

    lie: Callable[[DikProblem, Array, Array], tuple[Any, Any]]

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box()
        lower, upper = self.lie(problem, box.lower, box.upper)
        task = problem.primary
        v: Array = np.linalg.pinv(task.J, rcond=1e-6) @ task.V
        return np.clip(v, np.minimum(lower, upper), upper)


def mirrored(problem: DikProblem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Takes the upper bounds for both sides."""
    return -upper, upper


def a_little_more(problem: DikProblem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Passes the upper bounds by 0.1 mrad/s."""
    return lower, upper + 1e-4


def inside_only(problem: DikProblem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Forgets the position limits once it is outside of them."""
    to_upper, velocity = problem.limits.to_upper, problem.limits.joint.velocity
    if to_upper is None or velocity is None or problem.v_prev is not None:
        return lower, upper
    return lower, np.where(to_upper < 0, velocity.upper, upper)


def no_brake(problem: DikProblem, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Keeps no acceleration limit of a joint that was at rest."""
    velocity = problem.limits.joint.velocity
    if problem.v_prev is None or velocity is None or problem.limits.joint.acceleration is None:
        return lower, upper
    still = problem.v_prev == 0
    return np.where(still, velocity.lower, lower), np.where(still, velocity.upper, upper)


@pytest.mark.parametrize("lie", [mirrored, a_little_more, inside_only, no_brake])
def test_lying_law_is_caught_and_the_state_shrunk(lie: Any) -> None:
    """A law with one lie is caught, at a state where next to nothing is beside the point."""

    def caught(state: State) -> bool:
        try:
            check_state(Lying(lie), state)
        except AssertionError:
            return True
        return False

    state = find(states(), caught, settings=settings(FAST, max_examples=2000, derandomize=True))
    assert "dt 0.01, posture False" in state.label
    assert np.count_nonzero(state.problem.tasks[0].V) <= 1
    with pytest.raises(AssertionError, match=r"joint \d passes its \w+ limit"):
        check_state(Lying(lie), state)
    truth = Lying(lambda problem, lower, upper: (lower, upper))
    check_state(truth, state)


def test_law_that_raises_is_caught() -> None:
    """An error that is not `CannotAnswer` is a broken contract, too."""
    state = find(states(), lambda state: True, settings=FAST)

    def raises(problem: DikProblem, lower: Array, upper: Array) -> tuple[Array, Array]:
        raise ValueError("no")

    with pytest.raises(AssertionError, match="formulation-error: ValueError: no"):
        check_state(replace(Lying(raises)), state)
