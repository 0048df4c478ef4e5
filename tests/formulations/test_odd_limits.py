"""Limits that only some joints have: each formulation is tried with every mixture of them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
import pytest
from makers.problems import kinematics_at

from dikbench import PostureTask, Robot, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import plugins
from dikbench.problem import LinearizedTask, promises_of
from dikbench.problem.posing import pose_problem
from dikbench.simulation.status import Status
from dikbench.testing.asked import LIMIT_TOLERANCE_RAD_S, Asked
from dikbench.testing.contract import assert_within
from dikbench.testing.states import State

inf = np.inf
JOINT = 1
"""The joint whose limits are odd."""

Bounds = tuple[Array, Array]

ODD: dict[str, Callable[[float, float], tuple[float, float]]] = {
    "none": lambda lower, upper: (-inf, inf),
    "upper alone": lambda lower, upper: (-inf, upper),
    "lower alone": lambda lower, upper: (lower, inf),
    "equal": lambda lower, upper: (max(lower, min(0.0, upper)),) * 2,
    "one way": lambda lower, upper: (lower, max(lower, min(0.0, upper))),
}
"""(lower, upper) of one joint -> other bounds of it; equal ones are both at rest."""


def _of_one(bounds: Bounds, odd: str) -> Bounds:
    lower, upper = (bound.copy() for bound in bounds)
    lower[JOINT], upper[JOINT] = ODD[odd](float(lower[JOINT]), float(upper[JOINT]))
    return lower, upper


def _robots() -> Iterator[tuple[str, Robot]]:
    """Arms, each with one kind of limit of one joint that is odd, and one without any limit."""
    for name in ("planar3r", "panda"):
        robot = load_robot(name)
        assert robot.limits.position is not None
        assert robot.limits.velocity is not None
        assert robot.available_acceleration is not None
        a = robot.available_acceleration
        bounds: dict[str, Bounds] = {
            "position": (robot.limits.position.lower, robot.limits.position.upper),
            "velocity": (robot.limits.velocity.lower, robot.limits.velocity.upper),
            "acceleration": (-a, a),
        }
        for kind, odd in product(bounds, ODD):
            changed = robot.with_limits(acceleration=a)
            changed = changed.with_limits(**{kind: _of_one(bounds[kind], odd)})
            yield f"{name}, {kind}: {odd}", changed
        yield (
            f"{name}, no limit is finite",
            robot.with_limits(
                position=(np.full(robot.nv, -inf), np.full(robot.nv, inf)), velocity=inf
            ).with_limits(acceleration=inf),
        )


def _states() -> Iterator[State]:
    """Every such arm with its joint inside, at and outside of its limits; every second at rest.

    Before the others the velocity is not known. The twist drives the joint outwards, a posture task
    the others.
    """
    count = itertools.count()
    for label, robot in _robots():
        position = robot.limits.position
        assert position is not None
        for place, beyond in (("inside", -0.3), ("at", 0.0), ("outside", 0.01)):
            q = robot.q0.copy()
            if np.isfinite(position.upper[JOINT]):
                q[JOINT] = position.upper[JOINT] + beyond
            elif np.isfinite(position.lower[JOINT]):
                q[JOINT] = position.lower[JOINT] - beyond
            kinematics = kinematics_at(robot, q)
            J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
            V = 0.3 * np.sign(q[JOINT] - robot.q0[JOINT]) * J[:, JOINT] + 0.01
            v_prev = np.zeros(robot.nv) if next(count) % 2 else None
            task = LinearizedTask(J.copy(), V, 0.1 * V)
            posture = PostureTask(robot.q0, weight=0.01)
            problem = pose_problem(kinematics, v_prev, 0.01, task, [posture])
            yield State(f"{label}, {place}, v_prev {v_prev}", problem)


STATES = [*_states()]


@pytest.mark.parametrize("name", sorted(plugins("formulation")))
def test_limits_that_some_joints_lack_give_numbers_that_keep_the_others(name: str) -> None:
    """A velocity that keeps what is promised, or none that is infeasible: never NaN, or failed."""
    formulation = make_formulation(name)
    asked = Asked(formulation)
    for state in STATES if name != "lp-alpha-cvxpy" else STATES[::40]:
        v, status, message, residual = asked.answer(state.problem)
        assert status in {Status.OK, Status.INFEASIBLE}, f"{state.label}: {message}"
        if v is None:
            continue
        assert np.isfinite(v).all(), state.label
        for kind in promises_of(formulation):
            assert_within(state, kind, v, LIMIT_TOLERANCE_RAD_S + residual)


@pytest.mark.parametrize("solver", ["daqp", "piqp", "clarabel"])
@pytest.mark.parametrize("distance", [0.0, 1e-3])
def test_a_stop_without_a_speed_is_a_stop(solver: str, distance: float) -> None:
    """0 times no limit is 0: at its position limit a joint of `drake-system` stands."""
    robot = load_robot("ur5")
    position, velocity = robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    robot = robot.with_limits(velocity=np.where(np.arange(6) == 0, inf, velocity.upper))
    q = robot.q0.copy()
    q[0] = position.upper[0] - distance
    answer = solve_dik(
        robot, q, twist=[0, 0.3, 0, 0, 0, 0], reference_frame="LOCAL_WORLD_ALIGNED",
        formulation="drake-system", solver=solver,
    )  # fmt: skip
    assert answer.velocity[0] <= 1e-6
    assert answer.status is Status.STUCK
