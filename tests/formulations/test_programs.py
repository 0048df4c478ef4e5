"""Laws that solve programs against each other and against closed forms."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from makers.problems import equation, kinematics_at, problem_at, task_jacobian, velocity_of

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.linear_algebra import null_space
from dikbench.plugins.building import make_formulation
from dikbench.problem import DikProblem
from dikbench.problem.tasks import LinearizedTask, OrientationTask, PositionTask, PostureTask
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.solvers.checked_solve import make_solve
from dikbench.testing.states import SINGULAR
from formulations.lp_alpha_components import twist_from_rates
from formulations.lu_kernel import lu_kernel
from formulations.manipulability import manipulability_gradient

DT = 0.01


def _problem(
    robot: Robot, random: np.random.Generator, speed: float, *, second: str = "posture"
) -> DikProblem:
    """A random state near the robot's start with a random twist and a second task."""
    q = pin.integrate(robot.model, robot.q0, random.uniform(-0.4, 0.4, robot.nv))
    kinematics = kinematics_at(robot, q)
    tasks = [equation(kinematics.jacobian(robot.frame_id), speed * random.normal(size=6))]
    if second == "posture":
        target = pin.integrate(robot.model, q, random.uniform(-0.3, 0.3, robot.nv))
        tasks.append(PostureTask(target=target).linearize(kinematics))
    elif second == "elbow":
        X = kinematics.placement(robot.model.getFrameId("panda_link4"))
        point = X.translation + random.uniform(-0.2, 0.2, 3)
        elbow = PositionTask(target=point, frame="panda_link4", priority=2)
        tasks.append(elbow.linearize(kinematics))
    return problem_at(robot, q, tasks)


def _problems(count: int, speed: float, second: str = "posture") -> Iterator[DikProblem]:
    robot, random = load_robot("panda"), np.random.default_rng(0)
    for _ in range(count):
        yield _problem(robot, random, speed, second=second)


# --- hierarchies


def test_a_hierarchy_of_one_level_is_the_weighted_program() -> None:
    """Bounds active or not."""
    for speed in (0.1, 2.0):
        for problem in _problems(30, speed, "none"):
            one, qp = (velocity_of(law, problem) for law in ("hqp", "qp[braking=viable]"))
            assert one == pytest.approx(qp, abs=1e-6)


@pytest.mark.parametrize("second", ["posture", "elbow"])
def test_a_hierarchy_inside_the_limits_is_the_null_space_projection(second: str) -> None:
    """Two levels, no bound active, no damping: the recursive projection."""
    free = load_robot("panda").with_limits(position=None, velocity=None)
    random = np.random.default_rng(1)
    for _ in range(30):
        problem = _problem(free, random, 0.1, second=second)
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
    for problem in _problems(40, speed, second):
        alone = problem_at(problem.robot, problem.q, problem.tasks[:1])
        J = problem.tasks[0].J
        first = velocity_of("hqp[damping=1e-5]", alone)  # as the levels above the last have
        both = velocity_of("hqp", problem)
        assert J @ both == pytest.approx(J @ first, abs=1e-7)


def test_the_weighted_program_tends_to_the_hierarchy() -> None:
    """With weights of 1e6 to 1 the second task gives way to the first, inside the limits."""
    for problem in _problems(20, 1.0):
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
    for drawn in _problems(60, 1.5):
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
    for problem in _problems(30, 0.05, "none"):
        qp, dls = (velocity_of(law, problem) for law in ("qp-velocity", "dls[damping=1e-3]"))
        assert qp == pytest.approx(dls, abs=1e-7)
    for problem in _problems(30, 3.0, "none"):
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
    for problem in _problems(60, 1.0):
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
    for problem in _problems(20, 0.02, "none"):
        v = velocity_of("lp-alpha-components", problem)
        assert problem.primary.J @ v == pytest.approx(problem.primary.V, abs=1e-5)


def test_components_keep_axes_that_the_whole_would_slow_down() -> None:
    """The sum of the components is at least six times the common alpha."""
    gained = 0
    for problem in _problems(30, 1.5, "none"):
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
    for drawn in _problems(20, 0.0, "none"):
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


# --- NEO


def test_neo_without_its_reward_is_damped_least_squares() -> None:
    """Far from limits: min lambda ||v||^2 + ||V - J v||^2 / ||e||_1."""
    robot = load_robot("panda").with_limits(position=None, velocity=None)
    random = np.random.default_rng(3)
    for _ in range(20):
        problem = _problem(robot, random, 0.1, second="none")
        task = problem.tasks[0]
        task.error = random.uniform(-0.05, 0.05, 6)
        e = float(np.abs(task.error).sum())
        damped = velocity_of(f"dls[damping={float(np.sqrt(0.01 * e))!r}]", problem)
        assert velocity_of("neo[manipulability_gain=0]", problem) == pytest.approx(damped, abs=1e-6)


def test_neos_dampers_reach_over_a_share_of_each_range() -> None:
    """Half of it: one of the two is active wherever a joint is, to rest at the stop distance.

    v_i <= eta (d - rho_s)/(range/2 - rho_s), d to the nearer limit; none towards the other.
    """
    robot = load_robot("panda").with_limits(velocity=None)
    position = robot.limits.position
    assert position is not None
    law = "neo[damper_gain=0.5,stop_distance=0.001,influence_share=0.5,manipulability_gain=0]"
    random, active, fast = np.random.default_rng(5), 0, 0
    half = (position.upper - position.lower) / 2
    for _ in range(20):
        q = random.uniform(position.lower, position.upper)
        J = kinematics_at(robot, q).task_jacobian()
        task = LinearizedTask(J, J @ random.uniform(-3, 3, 7), np.full(6, 0.01))
        v = velocity_of(law, problem_at(robot, q, [task]))
        to_upper, to_lower = position.upper - q, q - position.lower
        bound = 0.5 * np.maximum(np.minimum(to_upper, to_lower) - 0.001, 0) / (half - 0.001)
        towards = np.where(to_upper < to_lower, v, -v)
        assert (towards <= bound + 1e-6).all()
        active += int((towards > bound - 1e-6).sum())
        fast += int((towards < -0.5).sum())
    assert active > 20
    assert fast > 20


def test_neos_reward_raises_the_manipulability() -> None:
    """To first order, compared with the same program without it."""
    better = 0
    for problem in _problems(30, 0.05, "none"):
        problem.tasks[0].error = np.full(6, 0.1)
        J = problem.tasks[0].J
        gradient = manipulability_gradient(J)
        with_it, without = (
            velocity_of(f"neo[manipulability_gain={gain}]", problem) for gain in (1, 0)
        )
        better += float(gradient @ with_it) > float(gradient @ without)
    assert better == 30


@pytest.mark.parametrize("name", ["panda", "ur5", "kinova", "planar3r"])
def test_manipulability_gradient_is_the_derivative(name: str) -> None:
    """By central differences."""
    robot, random = load_robot(name), np.random.default_rng(4)
    kinematics, rows = Kinematics(robot), list(robot.task_rows)

    def manipulability(q: Array) -> float:
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)[rows]
        return float(np.sqrt(np.linalg.det(J @ J.T)))

    for _ in range(5):
        q = pin.integrate(robot.model, robot.q0, random.uniform(-0.5, 0.5, robot.nv))
        kinematics.update(q)
        found = manipulability_gradient(kinematics.jacobian(robot.frame_id)[rows].copy())
        step = 1e-6 * np.eye(robot.nv)
        expected = [
            (
                manipulability(pin.integrate(robot.model, q, s))
                - manipulability(pin.integrate(robot.model, q, -s))
            )
            / 2e-6
            for s in step
        ]
        assert found == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("eps", [1e-2, 1e-5, 1e-8, 1e-11], ids=str)
def test_manipulability_gradient_near_a_singularity(eps: float) -> None:
    """On a planar arm w = l_1 l_2 |sin q_2|: next to the stretched arm it rises with q_2."""
    robot = load_robot("planar3r")
    kinematics, rows = Kinematics(robot), list(robot.task_rows)
    kinematics.update(np.array([0.4, eps, 0.7]))
    found = manipulability_gradient(kinematics.jacobian(robot.frame_id)[rows])
    kinematics.update(np.array([0.4, np.pi / 2, 0.7]))
    J = kinematics.jacobian(robot.frame_id)[rows]
    slope = abs(float(np.linalg.det(J))) * np.cos(eps)  # l_1 l_2 cos q_2
    assert found == pytest.approx([0, slope, 0], abs=1e-4 * slope)


def test_manipulability_has_no_gradient_at_a_singularity() -> None:
    """Where it is zero, up to rounding too, and where the rows are more than the joints."""
    assert np.array_equal(manipulability_gradient(np.zeros((6, 7))), np.zeros(7))
    tall = np.random.default_rng(0).normal(size=(6, 5))
    assert np.array_equal(manipulability_gradient(tall), np.zeros(5))
    for name, places in SINGULAR.items():
        robot = load_robot(name)
        kinematics = Kinematics(robot)
        for q in places:
            kinematics.update(np.array(q, dtype=float))
            J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
            assert np.array_equal(manipulability_gradient(J), np.zeros(robot.nv))


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
        ("neo[influence_share=0.6]", "neo: influence_share=0.6 must be"),
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
