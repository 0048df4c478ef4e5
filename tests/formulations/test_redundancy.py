"""Laws that use the null space for the joint limits: joint centring and weighted least norm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dikbench import PostureTask, Robot, load_robot, solve_dik
from dikbench.array import Array
from dikbench.kinematics import Kinematics
from dikbench.tasks.posture import middle_posture
from formulations.weighted_least_norm import limit_gradient

GAIN = 2.0


def states(robot: Robot, count: int, seed: int = 0) -> list[tuple[Array, Array, Array]]:
    """Configurations inside the limits, with their Jacobian and a wanted twist each."""
    position = robot.limits.position
    assert position is not None
    random = np.random.default_rng(seed)
    kinematics = Kinematics(robot)
    found = []
    for _ in range(count):
        q = random.uniform(position.lower + 0.05, position.upper - 0.05)
        kinematics.update(q)
        found.append((q, kinematics.jacobian(robot.frame_id).copy(), random.normal(size=6)))
    return found


@pytest.mark.parametrize("law", ["nullspace", "nullspace-robust"])
def test_joint_centring_is_strict_priority_over_the_middle_posture(law: str) -> None:
    """With a posture task at mid-range the priority laws give the same velocity."""
    robot = load_robot("panda")
    middle = PostureTask(middle_posture(robot), gain=GAIN)
    for q, J, twist in states(robot, 30):
        v = solve_dik(robot, q, formulation=f"joint-centering[gain={GAIN}]", twist=twist).velocity
        other = solve_dik(robot, q, formulation=law, twist=twist, tasks=[middle]).velocity
        np.testing.assert_allclose(v, other, rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(J @ v, twist, atol=1e-8)


def test_joint_centring_lowers_the_distance_to_mid_range() -> None:
    """With nothing to do the joints go towards mid-range as far as the frame can stay."""
    robot = load_robot("panda")
    middle = middle_posture(robot)
    for q, J, _ in states(robot, 30):
        v = solve_dik(robot, q, formulation="joint-centering", twist=np.zeros(6)).velocity
        null = np.linalg.svd(J)[2][6]
        np.testing.assert_allclose(v, null * (null @ (middle - q)), atol=1e-9)


def test_joint_without_two_limits_is_not_centred() -> None:
    """A joint that is limited on one side, or not at all, has no middle to go to."""
    robot = load_robot("planar3r")
    robot = robot.with_limits(position=([-2.0, -np.inf, -np.inf], [1.0, 1.0, np.inf]))
    robot = replace(robot, task_rows=(0,))
    q = np.array([0.4, 0.9, -0.3])
    kinematics = Kinematics(robot)
    kinematics.update(q)
    J = kinematics.jacobian(robot.frame_id)[:1]
    free = np.eye(3) - np.linalg.pinv(J) @ J
    v = solve_dik(robot, q, formulation="joint-centering", twist=np.zeros(6)).velocity
    np.testing.assert_allclose(v, free @ [-0.5 - 0.4, 0.0, 0.0], atol=1e-12)
    none = robot.with_limits(position=None)
    v = solve_dik(none, q, formulation="joint-centering", twist=np.zeros(6)).velocity
    np.testing.assert_array_equal(v, np.zeros(3))


def test_weighted_least_norm_is_the_pseudo_inverse_unless_a_joint_runs_into_a_limit() -> None:
    """Unknown motion, or all joints on their way to the middle: the weights are all 1."""
    robot = load_robot("panda")
    for q, J, twist in states(robot, 20):
        plain = np.linalg.pinv(J) @ twist
        for v_prev in (None, np.zeros(7), 0.3 * (middle_posture(robot) - q)):
            v = solve_dik(
                robot, q, formulation="weighted-least-norm", twist=twist, v_prev=v_prev
            ).velocity
            np.testing.assert_allclose(v, plain, rtol=1e-9, atol=1e-9)


def test_weighted_least_norm_in_closed_form() -> None:
    """V = W^-1 J^T (J W^-1 J^T)^-1 V, with the weights of those joints alone that go outwards."""
    robot = load_robot("panda")
    random = np.random.default_rng(3)
    moved = 0.0
    for q, J, twist in states(robot, 20):
        gradient = limit_gradient(robot.limits.at(q))
        v_prev = random.normal(size=7)
        w = 1 + np.where(v_prev * gradient > 0, np.abs(gradient), 0)
        wanted = (J / w).T @ np.linalg.solve((J / w) @ J.T, twist)
        v = solve_dik(
            robot, q, formulation="weighted-least-norm", twist=twist, v_prev=v_prev
        ).velocity
        np.testing.assert_allclose(v, wanted, rtol=1e-7, atol=1e-7)
        moved = max(moved, float(np.abs(v - np.linalg.pinv(J) @ twist).max()))
    assert moved > 0.1


def test_limit_gradient_is_the_derivative_of_its_potential() -> None:
    """dH/dq against central differences of H = sum (q_M - q_m)^2 / (4 (q_M - q)(q - q_m))."""
    robot = load_robot("panda")
    position = robot.limits.position
    assert position is not None
    low, up = position.lower, position.upper

    def potential(q: Array) -> float:
        return float(np.sum((up - low) ** 2 / (4 * (up - q) * (q - low))))

    for q, _, _ in states(robot, 10):
        step = 1e-6
        numeric = [
            (potential(q + step * e) - potential(q - step * e)) / (2 * step) for e in np.eye(7)
        ]
        np.testing.assert_allclose(
            limit_gradient(robot.limits.at(q)), numeric, rtol=1e-5, atol=1e-5
        )


@pytest.mark.parametrize("outside", [0.0, 1e-13, 0.01])
@pytest.mark.parametrize("side", [-1, 1])
def test_joint_at_its_limit_moves_inwards_only(side: int, outside: float) -> None:
    """At a limit and outside: stopped if it went outwards, as free as any if it went inwards."""
    robot = load_robot("panda")
    position = robot.limits.position
    assert position is not None
    q = robot.q0.copy()
    q[3] = (position.lower if side < 0 else position.upper)[3] + side * outside
    twist = np.array([0.1, -0.2, 0.3, 0.1, 0.2, 0.0])
    outwards, inwards = (
        solve_dik(
            robot,
            q,
            formulation="weighted-least-norm",
            twist=twist,
            v_prev=direction * side * np.eye(7)[3],
        ).velocity
        for direction in (1.0, -1.0)
    )
    plain = solve_dik(robot, q, formulation="pinv", twist=twist).velocity
    assert outwards[3] == 0
    np.testing.assert_allclose(inwards, plain, atol=1e-10)
    assert abs(plain[3]) > 1e-3


def test_joint_without_a_limit_is_never_stiffened() -> None:
    """Where one side is open the weight is 1, however near the other limit is."""
    robot = load_robot("planar3r").with_limits(
        position=([-2.0, -np.inf, -np.inf], [2.0, 0.5, np.inf])
    )
    gradient = limit_gradient(robot.limits.at(np.array([1.0, 0.4, 3.0])))
    assert gradient[0] == pytest.approx(16 * 2 / (4 * 1 * 9))
    np.testing.assert_array_equal(gradient[1:], [0.0, 0.0])
