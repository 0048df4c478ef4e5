"""The condition governor: slows the way into a singularity, never the way out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import equation, kinematics_at, problem_at, task_jacobian, velocity_of

from dikbench import PostureTask, Robot, load_robot
from dikbench.arrays import Array
from dikbench.testing.states import SINGULAR

PLAIN = "condition-governor[after=none]"
ARMS = ("panda", "ur5", "planar3r")


def condition(robot: Robot, q: Array) -> float:
    """Largest over smallest singular value of the task Jacobian."""
    return float(np.linalg.cond(task_jacobian(robot, q)))


def answer(robot: Robot, q: Array, V: Array, law: str = PLAIN) -> Array:
    """What the law gives for a twist V of the task frame."""
    return velocity_of(law, problem_at(robot, q, [equation(task_jacobian(robot, q), V)]))


def beside_wrist(angle: float) -> Array:
    """A posture of the UR5 whose wrist is so far [rad] from its singularity."""
    return np.array([0.3, -1.2, 1.4, -1.7, angle, 0.2])


def conditioned(target: float) -> Array:
    """The posture on that way with a given condition number."""
    robot, near, far = load_robot("ur5"), 1e-3, 1.0
    for _ in range(60):
        middle = (near + far) / 2
        near, far = (
            (middle, far) if condition(robot, beside_wrist(middle)) > target else (near, middle)
        )
    return beside_wrist(near)


@pytest.mark.parametrize(
    ("kappa", "scale"), [(16.0, 1.0), (17.5, 12.5 / 13), (23.5, 0.5), (29.0, 1 / 13), (31, 0)]
)
def test_approach_is_slowed_down_and_stopped_and_leaving_is_not(kappa: float, scale: float) -> None:
    """Straight into the UR5's wrist singularity: 1 up to 17, 0 from 30, a line between them."""
    robot, q = load_robot("ur5"), conditioned(kappa)
    v = np.array([0, 0, 0, 0, -0.3, 0])
    into, out = (answer(robot, q, task_jacobian(robot, q) @ (sign * v)) for sign in (1, -1))
    np.testing.assert_allclose(into, scale * v, atol=1e-6)
    np.testing.assert_allclose(out, -v, atol=1e-12)


@pytest.mark.parametrize("name", ARMS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=40)
def test_slows_down_exactly_where_the_condition_number_grows(name: str, seed: int) -> None:
    """At random, with thresholds about the posture's own: by finite differences along J^+ V."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q = robot.q0 + random.uniform(-0.8, 0.8, robot.nv)
    V, kappa = random.normal(size=len(robot.task_rows)), condition(robot, q)
    plain = np.linalg.pinv(task_jacobian(robot, q)) @ V
    step = 1e-5 * plain / np.linalg.norm(plain)
    growth = condition(robot, q + step) - condition(robot, q - step)
    if abs(growth) < 1e-6 * kappa:
        return  # it neither approaches nor leaves
    law = f"condition-governor[after=none,slow={kappa * 0.9!r},stop={kappa * 1.1!r}]"
    v = answer(robot, q, V, law)
    np.testing.assert_allclose(v, plain * (0.5 if growth > 0 else 1.0), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_a_singular_posture_can_be_left(name: str) -> None:
    """Where rank is lost every motion that the arm can make is let through."""
    robot, random = load_robot(name), np.random.default_rng(0)
    for posture in SINGULAR[name]:
        q = np.array(posture, dtype=float)
        J, V = task_jacobian(robot, q), random.normal(size=len(robot.task_rows))
        np.testing.assert_allclose(
            answer(robot, q, V), np.linalg.pinv(J, rcond=1e-8) @ V, atol=1e-9
        )


def test_locks_on_the_way_in_and_not_on_the_way_out() -> None:
    """In closed loop: it comes to rest before kappa = 30, and leaves as soon as it is asked to."""
    robot, q = load_robot("ur5"), conditioned(16.0)
    wanted, speeds = np.array([0, 0, 0, 0, -0.5, 0]), []
    for _ in range(400):
        v = answer(robot, q, task_jacobian(robot, q) @ wanted)
        speeds.append(float(np.linalg.norm(v)))
        q = q + 0.01 * v
    assert 29.5 < condition(robot, q) < 30
    assert speeds[-1] < 1e-3 < 0.4 < speeds[0]
    for _ in range(50):
        v = answer(robot, q, task_jacobian(robot, q) @ -wanted)
        np.testing.assert_allclose(v, -wanted, atol=1e-9)
        q = q + 0.01 * v
    assert condition(robot, q) < 16


def test_leaving_is_scaled_into_the_velocity_limits() -> None:
    """What the inverse asks for beside the singularity is cut to the fastest joint, on course."""
    robot, q = load_robot("ur5"), beside_wrist(1e-3)
    U = np.linalg.svd(task_jacobian(robot, q))[0]
    limit = robot.limits.velocity
    assert limit is not None
    fastest = [
        float(
            np.abs(
                answer(robot, q, sign * 0.1 * U[:, -1], "condition-governor") / limit.upper
            ).max()
        )
        for sign in (1, -1)
    ]
    assert sorted(fastest) == pytest.approx([0.0, 1.0])  # one way leads in, the other out


def test_the_arms_own_jacobian_decides_whatever_the_task() -> None:
    """A posture as the primary task is slowed down on the way into the singularity too."""
    robot, q = load_robot("ur5"), conditioned(23.5)
    kinematics = kinematics_at(robot, q)
    for sign, scale in ((1, 0.5), (-1, 1.0)):
        away = np.array([0, 0, 0, 0, -0.2 * sign, 0])
        task = PostureTask(q + away, priority=1).linearize(kinematics)
        v = velocity_of(PLAIN, problem_at(robot, q, [task]))
        np.testing.assert_allclose(v, scale * away, atol=1e-6)
