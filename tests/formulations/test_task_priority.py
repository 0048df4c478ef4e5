"""The null-space laws against each other, closed forms and stacked least squares."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import equation, equations, problem_of, velocity_of

from dikbench import PostureTask, Robot, load_robot
from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics, smallest_singular_value

PRIORITIES = ("nullspace", "nullspace-robust", "nullspace-unprojected")
PANDA = load_robot("panda")


def answer(law: str, *tasks: tuple[Array, Array], robot: Robot = PANDA) -> Array:
    """What a law gives for J_1 v = V_1 above J_2 v = V_2 above ...; it looks at nothing else."""
    return velocity_of(law, problem_of(*equations(*tasks), robot=robot))


def steps(count: int = 30) -> Iterator[tuple[Kinematics, Array, Array, np.random.Generator]]:
    """Panda configurations away from singularities: kinematics, hand's J, a twist, a generator."""
    position = PANDA.limits.position
    assert position is not None
    random, kinematics, found = np.random.default_rng(7), Kinematics(PANDA), 0
    while found < count:
        kinematics.update(random.uniform(position.lower, position.upper))
        J = kinematics.jacobian(PANDA.frame_id)
        if smallest_singular_value(J) > 0.05:
            found += 1
            yield kinematics, J, random.normal(size=6), random


def elbow_row(kinematics: Kinematics) -> Array:
    """How the joints move the elbow along its axis, as the self-motion does, (1, 7)."""
    return kinematics.jacobian(PANDA.model.getFrameId("panda_link4"))[2:3]


def self_motion(J: Array) -> Array:
    """The joint motion that leaves the hand where it is, as a row (1, 7)."""
    row: Array = np.linalg.svd(J)[2][6:]
    return row


def damped(A: Array) -> Array:
    """A^T (A A^T + lambda^2 I)^-1 with lambda = 0.1."""
    inverse: Array = A.T @ np.linalg.inv(A @ A.T + 0.01 * np.eye(len(A)))
    return inverse


@pytest.mark.parametrize("projector", ["exact", "damped"])
@pytest.mark.parametrize("name", ["nullspace", "nullspace-robust"])
def test_one_damped_task_is_damped_least_squares(name: str, projector: str) -> None:
    """With one task the damped law is `dls`, whatever the projector."""
    law = f"{name}[damping=0.05,projector={projector}]"
    for _, J, V, _ in steps():
        v = answer(law, (J, V))
        np.testing.assert_allclose(v, answer("dls[damping=0.05]", (J, V)), atol=1e-10)


@pytest.mark.parametrize("projector", ["exact", "damped"])
@pytest.mark.parametrize("name", ["nullspace", "nullspace-robust"])
def test_two_damped_tasks_in_closed_form(name: str, projector: str) -> None:
    """Both laws, damped, with either projector, as their formulas say in plain matrices."""
    law = f"{name}[damping=0.1,projector={projector}]"
    for kinematics, J, V, random in steps():
        J2, V2 = elbow_row(kinematics), random.normal(size=1)
        inverse = damped(J)
        N = np.eye(7) - (np.linalg.pinv(J) if projector == "exact" else inverse) @ J
        v = inverse @ V
        if name == "nullspace":
            expected = v + damped(J2 @ N) @ (V2 - J2 @ v)
        else:
            expected = v + N @ damped(J2) @ V2
        np.testing.assert_allclose(answer(law, (J, V), (J2, V2)), expected, atol=1e-10)


@pytest.mark.parametrize("name", PRIORITIES)
def test_one_task_is_the_pseudo_inverse(name: str) -> None:
    """With one task, every law of task priority is the pseudo-inverse."""
    for _, J, V, _ in steps():
        np.testing.assert_allclose(answer(name, (J, V)), answer("pinv", (J, V)), atol=1e-10)


def test_two_tasks_that_fill_the_arm_are_both_done() -> None:
    """Hand and elbow, seven independent rows: `nullspace` is the solution of the stacked system."""
    solved = 0
    for kinematics, J, V, random in steps():
        J2, V2 = elbow_row(kinematics), random.normal(size=1)
        stacked = np.vstack([J, J2])
        if smallest_singular_value(stacked) > 1e-3:
            reference = np.linalg.solve(stacked, np.concatenate([V, V2]))
            v = answer("nullspace", (J, V), (J2, V2))
            np.testing.assert_allclose(v, reference, rtol=1e-9, atol=1e-9)
            solved += 1
    assert solved > 25


@pytest.mark.parametrize("name", PRIORITIES[1:])
def test_orthogonal_tasks_leave_no_difference(name: str) -> None:
    """Where the row spaces are orthogonal, robust and unprojected are strict priority."""
    for _, J, V, random in steps():
        tasks = (J, V), (self_motion(J), random.normal(size=1))
        np.testing.assert_allclose(answer(name, *tasks), answer("nullspace", *tasks), atol=1e-10)


def test_posture_leaves_no_difference_to_the_robust_law() -> None:
    """A posture has nothing to invert: below one task, robust and strict priority are the same."""
    for kinematics, J, V, _ in steps():
        posture = PostureTask(PANDA.q0, gain=5.0).linearize(kinematics)
        tasks = (J, V), (posture.J, posture.V)
        np.testing.assert_allclose(
            answer("nullspace-robust", *tasks), answer("nullspace", *tasks), atol=1e-10
        )


def test_price_of_the_robust_law() -> None:
    """On oblique tasks it does the first, and the second only up to what theory says it misses."""
    missed = []
    for kinematics, J, V, random in steps():
        J2, V2 = elbow_row(kinematics), random.normal(size=1)
        v = answer("nullspace-robust", (J, V), (J2, V2))
        inverse = np.linalg.pinv(J)
        coupling = J2 @ inverse @ (V - J @ np.linalg.pinv(J2) @ V2)
        np.testing.assert_allclose(J @ v, V, atol=1e-10)
        np.testing.assert_allclose(J2 @ v - V2, coupling, atol=1e-9)
        missed.append(float(np.abs(coupling)[0]))
    assert np.median(missed) > 0.1


@pytest.mark.parametrize("angle", [1.0, 0.1, 1e-3])
def test_nearly_dependent_tasks_in_closed_form(angle: float) -> None:
    """Two rows at a small angle: strict priority asks for 1/sin, the robust law for less than 1."""
    robot = load_robot("planar3r")
    J1, J2 = np.array([[1.0, 0, 0]]), np.array([[np.cos(angle), np.sin(angle), 0]])
    cos, sin, zero, one = np.cos(angle), np.sin(angle), np.zeros(1), np.ones(1)
    upper, lower = ((J1, one), (J2, zero)), ((J1, zero), (J2, one))
    for law, expected in {
        "nullspace": ([1, -cos / sin, 0], [0, 1 / sin, 0]),
        "nullspace-robust": ([1, 0, 0], [0, sin, 0]),
        "nullspace-unprojected": ([sin**2, -cos * sin, 0], [cos, sin, 0]),
        "nullspace[damping=0.1]": (
            [1 / 1.01, -sin * cos / (sin**2 + 0.01) / 1.01, 0],
            [0, sin / (sin**2 + 0.01), 0],
        ),
        "nullspace-robust[damping=0.1]": ([1 / 1.01, 0, 0], [0, sin / 1.01, 0]),
    }.items():
        for tasks, reference in zip((upper, lower), expected, strict=True):
            np.testing.assert_allclose(
                answer(law, *tasks, robot=robot), reference, rtol=1e-9, atol=1e-12
            )


@given(seed=st.integers(0, 10**6), m1=st.integers(1, 6), m2=st.integers(1, 6))
@settings(deadline=None, max_examples=100)
def test_robust_law_is_bounded_by_its_tasks(seed: int, m1: int, m2: int) -> None:
    """||v|| <= ||J_1^+ V_1|| + ||J_2^+ V_2||, however dependent the tasks are."""
    random = np.random.default_rng(seed)
    J1 = random.normal(size=(m1, 7))
    J2 = random.normal(size=(m2, m1)) @ J1 + 10.0 ** random.uniform(-9, 0) * random.normal(
        size=(m2, 7)
    )
    V1, V2 = random.normal(size=m1), random.normal(size=m2)
    alone = [np.linalg.norm(answer("pinv", task)) for task in ((J1, V1), (J2, V2))]
    v = answer("nullspace-robust", (J1, V1), (J2, V2))
    assert np.linalg.norm(v) <= sum(alone) * (1 + 1e-9)


def test_three_levels_of_the_robust_law() -> None:
    """The third task is projected out of both above it, stacked, not only out of the second."""
    for kinematics, J, V, random in steps():
        tasks = [(J[:3], V[:3]), (elbow_row(kinematics), random.normal(size=1))]
        tasks.append((np.eye(7), random.normal(size=7)))
        expected, above = np.zeros(7), np.zeros((0, 7))
        for J_k, V_k in tasks:
            free = np.eye(7) - np.linalg.pinv(above, rcond=1e-9) @ above
            expected = expected + free @ np.linalg.pinv(J_k) @ V_k
            above = np.vstack([above, J_k])
        np.testing.assert_allclose(answer("nullspace-robust", *tasks), expected, atol=1e-8)


@pytest.mark.parametrize("law", ["nullspace", "nullspace[damping=0.1]", "nullspace-robust"])
def test_three_levels_disturb_nothing_above_them(law: str) -> None:
    """Each task added below leaves every task above at the velocity that it had without it."""
    for kinematics, J, V, random in steps():
        tasks = [(J[:3], V[:3]), (elbow_row(kinematics), random.normal(size=1))]
        tasks.append((np.eye(7), random.normal(size=7)))
        velocities = [answer(law, *tasks[:count]) for count in (1, 2, 3)]
        for number, more in ((0, 1), (0, 2), (1, 2)):
            J_k = tasks[number][0]
            np.testing.assert_allclose(J_k @ velocities[more], J_k @ velocities[number], atol=1e-9)
        assert np.abs(velocities[2] - velocities[1]).max() > 1e-2


def test_lowest_unprojected_task_is_done_whatever_it_costs_the_first() -> None:
    """The last task is done exactly; of a posture nothing else remains, the first is forgotten."""
    for kinematics, J, V, random in steps():
        J2, V2 = elbow_row(kinematics), random.normal(size=1)
        v = answer("nullspace-unprojected", (J, V), (J2, V2))
        np.testing.assert_allclose(J2 @ v, V2, atol=1e-10)
        posture = random.normal(size=7)
        v = answer("nullspace-unprojected", (J, V), (np.eye(7), posture))
        np.testing.assert_allclose(v, posture, atol=1e-10)


@pytest.mark.parametrize("name", ["nullspace", "nullspace-robust"])
def test_tasks_of_one_priority_are_one_task(name: str) -> None:
    """Hand position and orientation at one priority are the pose task."""
    for _, J, V, _ in steps(5):
        tasks = equation(J[:3], V[:3]), equation(J[3:], V[3:])
        v = velocity_of(name, problem_of(*tasks, robot=PANDA))
        np.testing.assert_allclose(v, answer("pinv", (J, V)), atol=1e-10)
