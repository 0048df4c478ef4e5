"""Laws that solve programs against each other and against closed forms."""

from __future__ import annotations

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from makers.problems import (
    equation,
    problem_at,
    random_step,
    random_steps,
    task_jacobian,
    velocity_of,
)

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.linear_algebra import null_space
from dikbench.plugins.building import make_formulation
from dikbench.problem import DikProblem
from dikbench.problem.tasks import LinearizedTask, OrientationTask, PositionTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.solvers.checked_solve import make_solve
from formulations.lp_alpha_components import twist_from_rates
from formulations.lu_kernel import lu_kernel

DT = 0.01


# --- hierarchies


def test_a_hierarchy_of_one_level_is_the_weighted_program() -> None:
    """Bounds active or not."""
    for speed in (0.1, 2.0):
        for problem in random_steps(30, speed, "none"):
            one, qp = (velocity_of(law, problem) for law in ("hqp", "qp[braking=viable]"))
            assert one == pytest.approx(qp, abs=1e-6)


@pytest.mark.parametrize("second", ["posture", "elbow"])
def test_a_hierarchy_inside_the_limits_is_the_null_space_projection(second: str) -> None:
    """Two levels, no bound active, no damping: the recursive projection."""
    free = load_robot("panda").with_limits(position=None, velocity=None)
    random = np.random.default_rng(1)
    for _ in range(30):
        problem = random_step(free, random, 0.1, second=second)
        hierarchy = velocity_of("hqp[damping=0]", problem)
        projection = velocity_of("nullspace", problem)
        for level in problem.levels:
            assert level.J @ hierarchy == pytest.approx(level.J @ projection, abs=1e-7)
        if second == "posture":
            assert hierarchy == pytest.approx(projection, abs=1e-7)


@pytest.mark.parametrize("second", ["posture", "elbow"])
@pytest.mark.parametrize("speed", [0.1, 1.0, 3.0])
def test_the_second_level_does_not_leak_into_the_first(second: str, speed: float) -> None:
    """What level 1 reaches alone it keeps, bounds active or not, to rounding."""
    for problem in random_steps(40, speed, second):
        alone = problem_at(problem.robot, problem.q, problem.tasks[:1])
        J = problem.tasks[0].J
        first = velocity_of("hqp[damping=1e-5]", alone)  # as the levels above the last have
        both = velocity_of("hqp", problem)
        assert J @ both == pytest.approx(J @ first, abs=1e-7)


def test_the_weighted_program_tends_to_the_hierarchy() -> None:
    """With weights of 1e6 to 1 the second task gives way to the first, inside the limits."""
    for problem in random_steps(20, 1.0):
        first, second = problem.tasks
        heavy = LinearizedTask(first.J, first.V, first.error, 1e6)
        weighted = problem_at(problem.robot, problem.q, [heavy, second])
        hierarchy, qp = velocity_of("hqp", problem), velocity_of("qp", weighted)
        assert first.J @ hierarchy == pytest.approx(first.J @ qp, abs=1e-3)
        assert hierarchy == pytest.approx(qp, abs=2e-2)


# --- programs without limits, and with velocity limits only


def test_three_levels_are_answered_where_bounds_bind() -> None:
    """Position, orientation and posture of a fast hand, a level hardly damped in between."""
    answered = 0
    for drawn in random_steps(60, 1.5):
        hand, posture = drawn.tasks
        position = LinearizedTask(hand.J[:3], hand.V[:3], np.zeros(3))
        orientation = LinearizedTask(hand.J[3:], hand.V[3:], np.zeros(3), priority=2)
        posture.priority = 3
        problem = msgspec.structs.replace(drawn, tasks=[posture, orientation, position])
        try:
            v = velocity_of("hqp", problem)
        except SolverFailed:
            continue
        answered += 1
        box = problem.box()
        assert np.all((box.lower - 1e-9 <= v) & (v <= box.upper + 1e-9))
    assert answered >= 58


def test_least_squares_in_velocity_limits_is_damped_least_squares_where_none_binds() -> None:
    """And elsewhere stays inside them, where clipping would too, with less error."""
    for problem in random_steps(30, 0.05, "none"):
        qp, dls = (velocity_of(law, problem) for law in ("qp-velocity", "dls[damping=1e-3]"))
        assert qp == pytest.approx(dls, abs=1e-7)
    for problem in random_steps(30, 3.0, "none"):
        task, limit = problem.primary, problem.limits.joint.velocity
        assert limit is not None
        qp = velocity_of("qp-velocity", problem)
        assert np.all(qp <= limit.upper + 1e-7)
        assert np.all(qp >= limit.lower - 1e-7)
        clip = velocity_of("pinv[after=clip]", problem)
        error, clipped = (float(np.linalg.norm(task.J @ v - task.V)) for v in (qp, clip))
        assert error <= clipped + 1e-4


# --- alpha in stages and by components


def _alpha(problem: DikProblem, v: Array) -> float:
    task = problem.primary
    return float(task.V @ task.J @ v / (task.V @ task.V))


def test_two_stages_go_as_far_as_one_and_nearer_to_the_posture() -> None:
    """The same alpha as the linear program; the null space serves the posture, Drake's leaks."""
    leaks = 0
    for problem in random_steps(60, 1.0):
        one = velocity_of("lp-alpha[regularization=0]", problem)
        two = velocity_of("alpha-two-stage", problem)
        drake = velocity_of("drake[centering=10]", problem)
        posture = problem.tasks[1]
        assert _alpha(problem, two) == pytest.approx(_alpha(problem, one), abs=1e-7)
        assert _alpha(problem, drake) <= _alpha(problem, two) + 1e-7
        leaks += _alpha(problem, drake) < _alpha(problem, two) - 1e-2
        off_one, off_two = (float(np.linalg.norm(posture.V - v)) for v in (one, two))
        assert off_two <= off_one + 1e-6
    assert leaks > 10


def test_components_are_the_whole_where_all_is_feasible() -> None:
    """Alpha = 1 in each: J v = V."""
    for problem in random_steps(20, 0.02, "none"):
        v = velocity_of("lp-alpha-components", problem)
        assert problem.primary.J @ v == pytest.approx(problem.primary.V, abs=1e-5)


def test_components_keep_axes_that_the_whole_would_slow_down() -> None:
    """The sum of the components is at least six times the common alpha."""
    gained = 0
    for problem in random_steps(30, 1.5, "none"):
        robot, task = problem.robot, problem.primary
        kinematics = Kinematics(robot)
        kinematics.update(problem.q)
        E = twist_from_rates(kinematics.placement(robot.frame_id).rotation)
        v = velocity_of("lp-alpha-components[regularization=0]", problem)
        alphas = np.linalg.solve(E, task.J @ v) / np.linalg.solve(E, task.V)
        common = _alpha(problem, velocity_of("lp-alpha[regularization=0]", problem))
        assert np.all(alphas >= -1e-6)
        assert np.all(alphas <= 1 + 1e-6)
        assert alphas.sum() >= 6 * common - 1e-6
        gained += alphas.sum() > 6 * common + 0.1
    assert gained > 20


def test_components_of_an_orientation_are_roll_pitch_and_yaw() -> None:
    """Each rate of the frame is a share of the wanted one, and they add up to the most there is."""
    random = np.random.default_rng(8)
    held_back = 0
    for drawn in random_steps(20, 0.0, "none"):
        kinematics = Kinematics(drawn.robot)
        kinematics.update(drawn.q)
        R = kinematics.placement(drawn.robot.frame_id).rotation
        target = R @ pin.exp3(random.uniform(-1, 1, 3))
        task = OrientationTask(target=target, gain=20.0).linearize(kinematics)
        problem = msgspec.structs.replace(drawn, tasks=[task])
        v = velocity_of("lp-alpha-components[regularization=0]", problem)
        E = twist_from_rates(R)[3:, 3:]
        alphas = np.linalg.solve(E, task.J @ v) / np.linalg.solve(E, task.V)
        common = _alpha(problem, velocity_of("lp-alpha[regularization=0]", problem))
        assert np.all((alphas >= -1e-6) & (alphas <= 1 + 1e-6))
        assert alphas.sum() >= 3 * common - 1e-6
        held_back += alphas.min() < 0.99
    assert held_back > 10


def test_components_of_a_position_need_no_rates_of_roll_and_yaw() -> None:
    """Also where the frame's x axis stands upright, where those of a pose are not defined."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    q = robot.q0.copy()
    for _ in range(50):  # turn the x axis up
        kinematics.update(q)
        R = kinematics.placement(robot.frame_id).rotation
        axis = np.cross([1.0, 0.0, 0.0], R.T[:, 2])
        J = kinematics.jacobian(robot.frame_id)
        q = pin.integrate(robot.model, q, 0.5 * np.linalg.pinv(J[3:], rcond=1e-3) @ axis)
    kinematics.update(q)
    R = kinematics.placement(robot.frame_id).rotation
    with pytest.raises(Infeasible, match="no rates near cos"):
        twist_from_rates(R)
    point = kinematics.placement(robot.frame_id).translation + np.array([0.01, -0.02, 0.01])
    task = PositionTask(target=point).linearize(kinematics)
    problem = problem_at(robot, q, [task])
    v = velocity_of("lp-alpha-components", problem)
    assert task.J @ v == pytest.approx(task.V, abs=1e-6)


@given(
    angles=arrays(float, 3, elements=st.floats(-1.4, 1.4)),
    rates=arrays(float, 3, elements=st.floats(-1, 1)),
)
def test_rates_of_roll_pitch_and_yaw_make_the_twist(angles: Array, rates: Array) -> None:
    """By central differences of R = Rz(yaw) Ry(pitch) Rx(roll)."""
    h = 1e-6
    R, ahead, behind = (pin.rpy.rpyToMatrix(angles + side * h * rates) for side in (0, 1, -1))
    angular = pin.log3(behind.T @ ahead) / (2 * h)
    E = twist_from_rates(R)
    assert E[3:, 3:] @ rates == pytest.approx(angular, abs=1e-6)
    velocity = np.array([0.3, -0.2, 0.1])
    assert E[:3, :3] @ velocity == pytest.approx(R.T @ velocity)


def test_upright_there_are_no_rates() -> None:
    """At a pitch of 90 degrees roll and yaw turn about the same axis."""
    with pytest.raises(Infeasible, match="no rates near cos"):
        twist_from_rates(pin.rpy.rpyToMatrix(np.array([0.2, np.pi / 2, 0.4])))


# --- Pink's and mink's program


@pytest.mark.parametrize("law", ["pink-qp", "mink-qp"])
def test_a_joint_without_acceleration_limit_at_its_position_limit_has_no_brake(law: str) -> None:
    """Infinite deceleration over no distance, and none over an infinite one, bound nothing."""
    robot = load_robot("panda")
    assert robot.limits.position is not None
    highest = robot.limits.position.upper.copy()
    highest[1] = np.inf
    deceleration = np.array([np.inf, 0.0, 20, 20, 20, 20, 20])
    robot = robot.with_limits(
        position=(robot.limits.position.lower, highest),
        acceleration=(-deceleration, np.full(7, 20.0)),
    )
    q = robot.q0.copy()
    q[0] = highest[0]
    J = task_jacobian(robot, q)
    wanted = np.array([-0.1, 0.1, 0.1, -0.1, 0.1, -0.1, 0.1])
    tasks = [equation(J, J @ wanted)]
    damped = make_formulation("dls[damping=0.01]")
    problem = problem_at(robot, q, tasks)
    expected = damped.velocity(problem, make_solve(None, None))
    assert expected[0] < 0
    assert velocity_of(f"{law}[damping=0.01]", problem) == pytest.approx(expected, abs=1e-8)


# --- kernels

matrices = arrays(float, (3, 5), elements=st.integers(-3, 3).map(float))


@settings(deadline=None)
@given(A=matrices)
def test_the_lu_kernel_spans_the_null_space(A: Array) -> None:
    """A K = 0, as many columns as the rank leaves, each with a one at a column of its own."""
    K = lu_kernel(A)
    rank = int(np.linalg.matrix_rank(A))
    assert K.shape == (5, 5 - rank)
    assert A @ K == pytest.approx(np.zeros((3, 5 - rank)), abs=1e-9)
    ones = [int(np.flatnonzero(K[:, k] == 1.0)[-1]) for k in range(5 - rank)]
    assert np.linalg.matrix_rank(K) == 5 - rank
    assert len(ones) == 5 - rank


@settings(deadline=None)
@given(A=matrices)
def test_the_null_space_is_orthonormal_and_complete(A: Array) -> None:
    """A N = 0, N^T N = I."""
    N = null_space(A, 1e-9)
    rank = int(np.linalg.matrix_rank(A))
    assert N.shape == (5, 5 - rank)
    assert A @ N == pytest.approx(np.zeros((3, 5 - rank)), abs=1e-9)
    assert N.T @ N == pytest.approx(np.eye(5 - rank), abs=1e-12)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        ("drake[centering=-1]", "drake: centering=-1.0 must be finite"),
        (
            "drake-system[tracking_weight=0]",
            "drake-system: tracking_weight=0.0 must be finite and above 0",
        ),
        ("hqp[damping=-1]", "hqp: damping=-1.0 must be finite"),
        ("neo[stop_distance=1]", "neo: stop_distance=1.0 must be below influence_distance=0.9"),
        ("pink-qp[position_gain=0]", "pink-qp: position_gain=0.0 must be above 0"),
        ("mink-qp[lm_damping=-1]", "mink-qp: lm_damping=-1.0 must be finite"),
        ("qp-velocity[damping=inf]", "qp-velocity: damping=inf must be finite"),
        ("alpha-two-stage[rank_tolerance=-1]", "alpha-two-stage: rank_tolerance=-1.0 must be"),
        (
            "lp-alpha-components[regularization=-1]",
            "lp-alpha-components: regularization=-1.0 must be",
        ),
    ],
)
def test_parameters_out_of_range_are_one_line(law: str, words: str) -> None:
    """The law, the parameter, what would be valid."""
    with pytest.raises(DikbenchError, match=words):
        make_formulation(law)
