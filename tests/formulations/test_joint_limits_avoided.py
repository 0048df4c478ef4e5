"""Joint centring and weighted least norm: what they choose where the task leaves a choice."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import equation, problem_at, velocity_of
from makers.scenarios import error_of

from dikbench import DikProblem, LinearizedTask, PostureTask, Robot, load_robot
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem.tasks import PositionTask
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.limits import Limits
from formulations.weighted_least_norm import mobility

PANDA = load_robot("panda")
assert PANDA.limits.middle is not None
MIDDLE = PANDA.limits.middle


def steps(robot: Robot, count: int = 30) -> Iterator[tuple[DikProblem, np.random.Generator]]:
    """Steps inside the limits, away from singularities, with a wanted twist and a motion before."""
    position = robot.limits.position
    assert position is not None
    random, kinematics, found = np.random.default_rng(11), Kinematics(robot), 0
    while found < count:
        q = random.uniform(np.maximum(position.lower, -np.pi), np.minimum(position.upper, np.pi))
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)
        if smallest_singular_value(J) > 0.05:
            found += 1
            task = equation(J, random.normal(size=6))
            yield problem_at(robot, q, [task], random.normal(size=robot.nv)), random


# --- joint centring


def test_centring_is_strict_priority_above_the_middle_posture() -> None:
    """Joint centring is `nullspace` with a posture task at the middle of the limits."""
    kinematics = Kinematics(PANDA)
    for problem, _ in steps(PANDA):
        kinematics.update(problem.q)
        posture = PostureTask(MIDDLE, gain=3.0).linearize(kinematics)
        centred = velocity_of("joint-centering[gain=3]", problem)
        both = msgspec.structs.replace(problem, tasks=[posture, *problem.tasks])
        np.testing.assert_allclose(centred, velocity_of("nullspace", both), atol=1e-10)
        assert np.abs(centred - velocity_of("pinv", problem)).max() > 1e-3


@pytest.mark.parametrize("projector", ["exact", "damped"])
def test_damped_centring_in_closed_form(projector: str) -> None:
    """With damping, the hand goes as in `dls`, plus what the damped "projector" lets through."""
    for problem, _ in steps(PANDA):
        J, V = problem.tasks[0].J, problem.tasks[0].V
        inverse = J.T @ np.linalg.inv(J @ J.T + 0.01 * np.eye(6))
        free = np.eye(7) - (inverse if projector == "damped" else np.linalg.pinv(J)) @ J
        expected = inverse @ V + free @ (2.0 * (MIDDLE - problem.q))
        v = velocity_of(f"joint-centering[gain=2,damping=0.1,projector={projector}]", problem)
        np.testing.assert_allclose(v, expected, atol=1e-10)


@pytest.mark.parametrize("projector", ["exact", "damped"])
def test_centring_with_gain_zero_is_damped_least_squares(projector: str) -> None:
    """With no gain it is `dls`, and the pseudo-inverse without damping."""
    for problem, _ in steps(PANDA):
        for damping, other in ((0.05, "dls[damping=0.05]"), (0.0, "pinv")):
            law = f"joint-centering[gain=0,damping={damping},projector={projector}]"
            np.testing.assert_allclose(
                velocity_of(law, problem), velocity_of(other, problem), atol=1e-10
            )


def test_centring_moves_joints_inwards_under_a_hand_at_rest() -> None:
    """Asked to hold still, the joints approach their middle while the hand stays where it is."""
    kinematics = Kinematics(PANDA)
    q = np.array([0.9, -0.8, -0.9, -2.2, 0.9, 1.8, 0.8])
    kinematics.update(q)
    target, distances = kinematics.placement(PANDA.frame_id).copy(), []
    for _ in range(300):
        kinematics.update(q)
        task = LinearizedTask(kinematics.jacobian(PANDA.frame_id), np.zeros(6), np.zeros(6))
        distances.append(float(np.linalg.norm(q - MIDDLE)))
        q = q + 0.001 * velocity_of("joint-centering[gain=2]", problem_at(PANDA, q, [task]))
    drift = pin.log6(target.actInv(kinematics.placement(PANDA.frame_id))).np
    assert np.all(np.diff(distances) < 0)
    assert distances[0] - distances[-1] > 0.03
    assert np.linalg.norm(drift) < 1e-4


def test_joint_without_limits_is_not_centred() -> None:
    """Continuous joints, joints with one limit and joints whose limits are not in force."""
    kinova = load_robot("kinova")
    kinematics, q = Kinematics(kinova), kinova.q0
    kinematics.update(q)
    task = PositionTask(np.array([0.3, 0.3, 0.3])).linearize(kinematics)
    problem = problem_at(kinova, q, [task])
    position, seen = kinova.limits.position, problem.limits.coordinates
    assert position is not None
    assert seen is not None
    kept = np.flatnonzero(np.isfinite(position.lower))
    assert kept.tolist() == [1, 2, 4]
    wish = np.zeros(6)
    wish[kept] = (position.lower[kept] + position.upper[kept]) / 2 - seen[kept]
    expected = np.linalg.pinv(task.J) @ task.V + wish - np.linalg.pinv(task.J) @ task.J @ wish
    np.testing.assert_allclose(velocity_of("joint-centering", problem), expected, atol=1e-10)

    position = PANDA.limits.position
    assert position is not None
    half = PANDA.with_limits(position=(np.where(np.arange(7) == 2, -np.inf, position.lower), 3.0))
    none = PANDA.with_limits(position=None)
    for problem, _ in steps(PANDA, 5):
        task = problem.tasks[0]
        wish = (position.lower + 3.0) / 2 - problem.q
        wish[2] = 0.0
        expected = velocity_of("pinv", problem) + wish - np.linalg.pinv(task.J) @ task.J @ wish
        v = velocity_of("joint-centering", problem_at(half, problem.q, [task]))
        np.testing.assert_allclose(v, expected, atol=1e-10)
        unlimited = problem_at(none, problem.q, [task])
        np.testing.assert_allclose(
            velocity_of("joint-centering", unlimited), velocity_of("pinv", unlimited), atol=1e-10
        )


# --- weighted least norm


def potential(q: Array, lower: Array, upper: Array) -> Array:
    """Each joint's share of H."""
    share: Array = (upper - lower) ** 2 / (4 * (upper - q) * (q - lower))
    return share


@given(
    where=st.floats(0.01, 0.99),
    lower=st.floats(-3, 3),
    width=st.floats(0.1, 6),
    speed=st.floats(-2, 2).filter(lambda speed: abs(speed) > 1e-3),
)
@settings(deadline=None, max_examples=200)
def test_weight_is_the_slope_of_the_potential(
    where: float, lower: float, width: float, speed: float
) -> None:
    """1/w - 1 is |dH/dq| by finite differences on the way to a limit, and 0 on the way back."""
    low, high = np.array([lower]), np.array([lower + width])
    q, step = low + where * width, 1e-6 * width
    slope = (potential(q + step, low, high) - potential(q - step, low, high)) / (2 * step)
    weight = 1 / mobility(q - low, high - q, np.array([speed]))
    if speed * (2 * q - low - high)[0] > 0:
        np.testing.assert_allclose(weight - 1, np.abs(slope), rtol=1e-5, atol=1e-4)
    else:
        np.testing.assert_array_equal(weight, 1.0)


def test_weights_at_and_beyond_limits_and_without() -> None:
    """Outwards from a limit on: no mobility; inwards, at rest or with one limit or none: all."""
    inf = np.inf
    for to_lower, to_upper, out in ((2.0, 0.0, 1), (2.5, -0.5, 1), (0.0, 2.0, -1), (-0.5, 2.5, -1)):
        speeds = np.array([out, -out, 0.0])
        shares = mobility(np.full(3, to_lower), np.full(3, to_upper), speeds)
        np.testing.assert_array_equal(shares, [0, 1, 1])
    for to_lower, to_upper in ((inf, inf), (inf, 0.1), (0.1, inf)):
        shares = mobility(np.full(3, to_lower), np.full(3, to_upper), np.array([-1.0, 0.0, 1.0]))
        np.testing.assert_array_equal(shares, [1, 1, 1])


def test_weighted_norm_is_the_least() -> None:
    """The task is done, W v has no part in the self-motion, and the published formula agrees."""
    position = PANDA.limits.position
    assert position is not None
    lower, upper, departures = position.lower, position.upper, []
    for problem, _ in steps(PANDA):
        q, J, V = problem.q, problem.tasks[0].J, problem.tasks[0].V
        slope = (upper - lower) ** 2 * (2 * q - upper - lower)
        slope /= 4 * (upper - q) ** 2 * (q - lower) ** 2
        assert problem.v_prev is not None
        w = np.where(problem.v_prev * slope > 0, 1 + np.abs(slope), 1.0)
        v = velocity_of("weighted-least-norm", problem)
        np.testing.assert_allclose(J @ v, V, atol=1e-9)
        assert abs(np.linalg.svd(J)[2][6] @ (w * v)) < 1e-8 * np.linalg.norm(w)
        for damping in (0.0, 0.1):
            inverse = (J / w).T @ np.linalg.inv((J / w) @ J.T + damping**2 * np.eye(6))
            v = velocity_of(f"weighted-least-norm[damping={damping}]", problem)
            np.testing.assert_allclose(v, inverse @ V, rtol=1e-7, atol=1e-8)
        departures.append(np.abs(v - velocity_of("dls[damping=0.1]", problem)).max())
    assert np.median(departures) > 0.01  # the weights were at work


def test_no_joint_on_its_way_out_leaves_the_pseudo_inverse() -> None:
    """With every joint on its way in, at rest, or its motion unknown it is the pseudo-inverse."""
    for problem, _ in steps(PANDA):
        for v_prev in (MIDDLE - problem.q, np.zeros(7), None):
            problem.v_prev = v_prev
            np.testing.assert_allclose(
                velocity_of("weighted-least-norm", problem),
                velocity_of("pinv", problem),
                atol=1e-10,
            )


def test_no_limits_leave_the_pseudo_inverse() -> None:
    """Without position limits in force there is nothing to spare."""
    robot = PANDA.with_limits(position=None)
    for problem, _ in steps(PANDA, 5):
        free = problem_at(robot, problem.q, problem.tasks, problem.v_prev)
        np.testing.assert_allclose(
            velocity_of("weighted-least-norm", free), velocity_of("pinv", free), atol=1e-10
        )


def test_square_jacobian_leaves_no_choice() -> None:
    """On six joints the weights change nothing: the task determines every joint."""
    for problem, _ in steps(load_robot("ur5")):
        weighted, plain = velocity_of("weighted-least-norm", problem), velocity_of("pinv", problem)
        np.testing.assert_allclose(weighted, plain, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("margin", [0.01, 1e-4, 0.0, -1e-3])
def test_joint_near_its_limit_is_spared(margin: float) -> None:
    """A joint that is about to pass its limit is slowed down for the others, at the limit to 0."""
    position = PANDA.limits.position
    assert position is not None
    q = PANDA.q0 + 0.4 * np.sin(np.arange(7))  # in a plane the arm could not do without the joint
    q[5] = position.upper[5] - margin
    kinematics = Kinematics(PANDA)
    kinematics.update(q)
    J = kinematics.jacobian(PANDA.frame_id)
    wanted = J @ np.eye(7)[5]
    problem = problem_at(PANDA, q, [equation(J, wanted)], np.eye(7)[5])
    v, plain = velocity_of("weighted-least-norm", problem), velocity_of("pinv", problem)
    assert plain[5] > 0.3
    assert 0 <= v[5] < 0.1 * plain[5]
    assert margin > 0 or v[5] == 0
    np.testing.assert_allclose(J @ v, wanted, atol=1e-9)


@pytest.mark.parametrize(
    ("selector", "message"),
    [
        ("joint-centering[gain=-1]", "joint-centering: gain=-1.0 must be"),
        ("joint-centering[damping=inf]", "joint-centering: damping=inf must be"),
        (
            "weighted-least-norm[rank_tolerance=nan]",
            "weighted-least-norm: rank_tolerance=nan",
        ),
        ("nullspace[damping=-0.1]", "nullspace: damping=-0.1 must be"),
        ("nullspace-robust[damping=nan]", "nullspace-robust: damping=nan must be"),
        (
            "nullspace-unprojected[rank_tolerance=-1]",
            "nullspace-unprojected: rank_tolerance=-1.0",
        ),
        ("nullspace[projector=none]", "exact"),
    ],
)
def test_parameters_are_checked(selector: str, message: str) -> None:
    """A parameter that makes no sense is one line that names the law and the parameter."""
    assert message in error_of(make_formulation, selector)


def test_limits_have_a_middle_where_both_sides_are_finite() -> None:
    """The middle of the limits, NaN where a joint has not both, None where none are in force."""
    lower, upper = np.array([-1.0, -np.inf, 0, 0, 1, 2, 3]), np.array([2.0, 1, np.inf, 1, 2, 3, 4])
    limits: Limits = PANDA.with_limits(position=(lower, upper)).limits.at(PANDA.q0)
    assert limits.joint.middle is not None
    np.testing.assert_array_equal(limits.joint.middle, [0.5, np.nan, np.nan, 0.5, 1.5, 2.5, 3.5])
    assert PANDA.with_limits(position=None).limits.middle is None
