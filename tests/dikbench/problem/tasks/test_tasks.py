"""Tasks: their Jacobians against finite differences, feed-forward, stacking."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import problem_of

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.problem.tasks import (
    CentreOfMassTask,
    DampingTask,
    LinearizedTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
)
from dikbench.problem.tasks.task import stacked
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot

STEP = 1e-6
TOLERANCE = 1e-5

ROBOTS = ("panda", "ur5", "planar3r")
seeds = st.integers(0, 2**32 - 1)


@lru_cache
def _kinova() -> Robot:
    """An arm with continuous joints."""
    for file in importlib.metadata.distribution("example-robot-data").files or ():
        if str(file).endswith("kinova_description/robots/kinova.urdf"):
            return load_robot(str(file.locate()), "j2s6s200_end_effector")
    pytest.fail("example-robot-data has no kinova.urdf")


def _robot(name: str) -> Robot:
    return _kinova() if name == "kinova" else load_robot(name)


def _at(robot: Robot, q: Array) -> Kinematics:
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics


def _random_q(robot: Robot, random: np.random.Generator, spread: float = 2.0) -> Array:
    """A configuration up to `spread` [rad] away from the start, joint by joint."""
    q: Array = pin.integrate(robot.model, robot.q0, random.uniform(-spread, spread, robot.nv))
    return q


def _placement(robot: Robot, q: Array) -> pin.SE3:
    return _at(robot, q).placement(robot.frame_id).copy()


def _error_derivative(robot: Robot, task: Task, q: Array) -> Array:
    """d(error)/dv by central differences, (m, nv)."""
    columns = []
    for joint in range(robot.nv):
        step = np.zeros(robot.nv)
        step[joint] = STEP
        ahead, behind = (
            task.linearize(_at(robot, pin.integrate(robot.model, q, sign * step))).error
            for sign in (1, -1)
        )
        columns.append((ahead - behind) / (2 * STEP))
    return np.column_stack(columns)


def _predicted_derivative(task: LinearizedTask) -> Array:
    Jl = task.log_derivative
    return -task.J if Jl is None else -Jl @ task.J


@pytest.mark.parametrize("name", ROBOTS)
@settings(deadline=None, max_examples=25)
@given(seed=seeds)
def test_pose_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -(Jl J) at random configurations and targets, also far away from each other."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    q = _random_q(robot, random)
    target = _placement(robot, _random_q(robot, random))
    relative = _placement(robot, q).actInv(target)
    if np.linalg.norm(pin.log3(relative.rotation)) > 3.0:
        target = _placement(robot, q)  # beside the logarithm's cut no difference is small
    task = PoseTask(target=target)
    assert np.allclose(
        _error_derivative(robot, task, q),
        _predicted_derivative(task.linearize(_at(robot, q))),
        atol=TOLERANCE,
        rtol=TOLERANCE,
    )


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_pose_error_at_the_target_changes_as_the_plain_jacobian_says(name: str) -> None:
    """Where the error is zero Jl is the identity: d(error)/dv = -J."""
    robot = _robot(name)
    random = np.random.default_rng(1)
    for _ in range(5):
        q = _random_q(robot, random)
        task = PoseTask(target=_placement(robot, q))
        assert np.allclose(
            _error_derivative(robot, task, q), -task.linearize(_at(robot, q)).J, atol=TOLERANCE
        )


def test_pose_task_on_another_frame() -> None:
    """The Jacobian and the error are that frame's: joints behind it do not move it."""
    robot, random = load_robot("panda"), np.random.default_rng(2)
    q = _random_q(robot, random)
    elbow = _at(robot, _random_q(robot, random, 0.3))
    target = elbow.placement(robot.model.getFrameId("panda_link4")).copy()
    task = PoseTask(target=target, frame="panda_link4")
    linearized = task.linearize(_at(robot, q))
    assert np.allclose(
        _error_derivative(robot, task, q), _predicted_derivative(linearized), atol=TOLERANCE
    )
    assert np.all(linearized.J[:, 4:] == 0)
    with pytest.raises(DikbenchError, match="did you mean 'panda_link4'"):
        PoseTask(target=target, frame="panda_lnk4").linearize(_at(robot, q))


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_posture_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -I for e = q* (-) q, on continuous joints too."""
    robot, random = _robot(name), np.random.default_rng(seed)
    q = _random_q(robot, random, 1.0)
    task = PostureTask(target=_random_q(robot, random, 1.0))
    linearized = task.linearize(_at(robot, q))
    assert np.array_equal(linearized.J, np.eye(robot.nv))
    assert np.allclose(_error_derivative(robot, task, q), -linearized.J, atol=TOLERANCE)


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_posture_task_drives_towards_its_target(name: str) -> None:
    """The sign is v = + gain e: integrating it for 1/gain arrives (science 7: two pages slip)."""
    robot = _robot(name)
    random = np.random.default_rng(3)
    q, target = _random_q(robot, random, 0.5), _random_q(robot, random, 0.5)
    task = PostureTask(target=target, gain=4.0).linearize(_at(robot, q))
    arrived = pin.integrate(robot.model, q, task.V / 4.0)
    assert np.allclose(arrived, target, atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_pose_task_drives_towards_its_target(name: str) -> None:
    """Following J v = V for a small step shortens the error by gain dt, in every row."""
    robot, random = load_robot(name), np.random.default_rng(4)
    dt, gain = 1e-4, 3.0
    for _ in range(5):
        q = _random_q(robot, random, 0.4)
        target = _placement(
            robot, pin.integrate(robot.model, q, 0.2 * random.normal(size=robot.nv))
        )
        task = PoseTask(target=target, gain=gain)
        here = task.linearize(_at(robot, q))
        v = np.linalg.lstsq(here.J, here.V, rcond=None)[0]
        there = task.linearize(_at(robot, pin.integrate(robot.model, q, dt * v)))
        assert np.allclose(there.error, (1 - gain * dt) * here.error, atol=1e-6)


def test_pose_error_is_the_body_twist_to_the_target() -> None:
    """X exp6(error) is the target, by the exponential of a hand-made twist."""
    robot = load_robot("ur5")
    X = _placement(robot, robot.q0)
    twist = np.array([0.1, -0.2, 0.05, 0.4, -0.3, 0.2])
    task = PoseTask(target=X * pin.exp6(pin.Motion(twist)), gain=2.5)
    linearized = task.linearize(_at(robot, robot.q0))
    assert linearized.error == pytest.approx(twist)
    assert linearized.V == pytest.approx(2.5 * twist)


def test_a_target_of_the_step_replaces_the_tasks_own() -> None:
    """A tracking task is made once and given its target at every step."""
    robot = load_robot("ur5")
    at, X = _at(robot, robot.q0), _placement(robot, robot.q0)
    shift = np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])
    moved = X * pin.exp6(pin.Motion(shift))
    assert PoseTask().linearize(at, moved).error == pytest.approx(shift)
    assert PoseTask(target=X).linearize(at, moved).error == pytest.approx(shift)
    assert PoseTask(target=moved).linearize(at).error == pytest.approx(shift)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("seed", range(5))
def test_feed_forward_keeps_the_error_of_a_moving_target(name: str, seed: int) -> None:
    """A frame that follows the transported V_d keeps its error; with V_d as it is it would not."""
    robot, random = load_robot(name), np.random.default_rng(seed)
    rows = np.array(robot.task_rows)
    h = 1e-5
    q = _random_q(robot, random, 0.4)
    target = _placement(robot, pin.integrate(robot.model, q, 0.3 * random.normal(size=robot.nv)))
    V_d = np.zeros(6)
    V_d[rows] = random.normal(size=len(rows))
    moved = target * pin.exp6(pin.Motion(h * V_d))
    task = PoseTask(gain=0.0)
    here = task.linearize(_at(robot, q), target, pin.Motion(V_d))

    def drift(V: Array) -> float:
        v = np.linalg.lstsq(here.J, V, rcond=None)[0]
        there = task.linearize(_at(robot, pin.integrate(robot.model, q, h * v)), moved)
        return float(np.linalg.norm(there.error - here.error)) / h

    assert drift(here.V) < 1e-3
    assert drift(V_d[rows]) > 0.02


def test_feed_forward_and_feedback_add_up() -> None:
    """V = Ad(X^-1 X_d) V_d + gain e."""
    robot, random = load_robot("panda"), np.random.default_rng(6)
    at = _at(robot, robot.q0)
    target, V_d = _placement(robot, _random_q(robot, random, 0.3)), random.normal(size=6)
    both = PoseTask(gain=3.0).linearize(at, target, pin.Motion(V_d))
    feedback = PoseTask(gain=3.0).linearize(at, target)
    forward = PoseTask(gain=0.0).linearize(at, target, pin.Motion(V_d))
    assert both.V == pytest.approx(feedback.V + forward.V)
    assert feedback.V == pytest.approx(3.0 * feedback.error)
    # The action matrix by hand: angular turned, linear turned plus lever times angular.
    relative = _placement(robot, robot.q0).inverse() * target
    R, p = relative.rotation, relative.translation
    angular = R @ V_d[3:]
    assert forward.V == pytest.approx(np.concatenate([R @ V_d[:3] + np.cross(p, angular), angular]))


@pytest.mark.parametrize("name", ROBOTS)
def test_log_derivative_leaves_the_error_itself(name: str) -> None:
    """Jl e = e, and Jl = I at the target: nothing changes for one task at full rank."""
    robot, random = load_robot(name), np.random.default_rng(7)
    q = _random_q(robot, random, 0.5)
    task = PoseTask(target=_placement(robot, _random_q(robot, random, 0.5))).linearize(
        _at(robot, q)
    )
    Jl = task.log_derivative
    assert Jl is not None
    assert np.abs(Jl - np.eye(len(Jl))).max() > 1e-3
    assert Jl @ task.error == pytest.approx(task.error)
    there = PoseTask(target=_placement(robot, q)).linearize(_at(robot, q)).log_derivative
    assert there == pytest.approx(np.eye(len(Jl)))


def test_a_planar_arm_keeps_three_rows() -> None:
    """x, y and yaw in the axes of the tip; the error of a target in the plane is complete."""
    robot = load_robot("planar3r")
    q = np.array([0.0, np.pi / 2, 0.0])  # tip at (0.4, 0.5), pointing along +y
    target = pin.SE3(pin.utils.rotate("z", np.pi / 2), np.array([0.4, 0.7, 0.0]))
    task = PoseTask(target=target, gain=2.0).linearize(_at(robot, q))
    assert task.J == pytest.approx(np.array([[0.4, 0, 0], [0.5, 0.5, 0.2], [1, 1, 1]]))
    assert task.error == pytest.approx([0.2, 0, 0])
    assert task.V == pytest.approx([0.4, 0, 0])
    twist = pin.Motion(np.array([0, 0, 9.0, 9.0, 9.0, 0.5]))
    turned = PoseTask().linearize(_at(robot, q), target, twist)
    assert turned.V == pytest.approx([0.2, -0.2 * 0.5, 0.5])  # the lever of 0.2 m turns with it
    assert turned.log_derivative is not None
    assert turned.log_derivative.shape == (3, 3)


# --- joints at rest, and the centre of mass


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
def test_damping_task_wants_joints_at_rest(name: str) -> None:
    """J = I and V = 0, one row per joint, wherever the robot is."""
    robot = _robot(name)
    task = DampingTask(weight=0.5).linearize(_at(robot, _random_q(robot, np.random.default_rng(9))))
    assert np.array_equal(task.J, np.eye(robot.nv))
    assert np.array_equal(task.V, np.zeros(robot.nv))
    assert np.array_equal(task.error, np.zeros(robot.nv))
    assert (task.weight, task.priority) == (0.5, 2)


@pytest.mark.parametrize("name", [*ROBOTS, "kinova"])
@settings(deadline=None, max_examples=10)
@given(seed=seeds)
def test_centre_of_mass_error_changes_as_the_jacobian_says(name: str, seed: int) -> None:
    """d(error)/dv = -J at random configurations."""
    robot, random = _robot(name), np.random.default_rng(seed)
    q = _random_q(robot, random)
    task = CentreOfMassTask(random.normal(size=3))
    linearized = task.linearize(_at(robot, q))
    assert linearized.J.shape == (3, robot.nv)
    assert np.abs(linearized.J).max() > 1e-2
    assert np.allclose(_error_derivative(robot, task, q), -linearized.J, atol=TOLERANCE)


def test_centre_of_mass_by_hand() -> None:
    """Three links of 1 kg, stretched along x: the mean of their middles, and its levers."""
    robot = load_robot("planar3r")
    task = CentreOfMassTask([0.5, 0.1, 0.0], gain=2.0, weight=3.0, priority=1)  # type: ignore[arg-type]
    linear = task.linearize(_at(robot, np.zeros(3)))
    middles = np.array([0.2, 0.4 + 0.15, 0.4 + 0.3 + 0.1])
    assert linear.error == pytest.approx([0.5 - middles.mean(), 0.1, 0], abs=1e-12)
    assert linear.V == pytest.approx(2 * linear.error)
    levers = [middles.sum() / 3, (0.15 + 0.4) / 3, 0.1 / 3]
    assert linear.J == pytest.approx(np.array([[0, 0, 0], levers, [0, 0, 0]]), abs=1e-12)
    assert (linear.weight, linear.priority) == (3.0, 1)


def test_centre_of_mass_task_drives_towards_its_target() -> None:
    """Following J v = V for a small step shortens the error by gain dt, in every axis."""
    robot, random = load_robot("ur5"), np.random.default_rng(10)
    for _ in range(5):
        q = _random_q(robot, random, 1.0)
        reach = 0.02 * random.normal(size=3)
        task = CentreOfMassTask(_at(robot, q).centre_of_mass()[0] + reach, gain=4.0)
        before = task.linearize(_at(robot, q))
        v = np.linalg.pinv(before.J) @ before.V
        after = task.linearize(_at(robot, pin.integrate(robot.model, q, v * 1e-4)))
        assert after.error == pytest.approx((1 - 4e-4) * before.error, abs=2e-7)


def test_centre_of_mass_leaves_the_kinematics_as_they_are() -> None:
    """Placements and Jacobians taken before and after it are the same, and are no views of it."""
    robot = load_robot("panda")
    kinematics = _at(robot, robot.q0 + 0.3)
    J, X = kinematics.jacobian(robot.frame_id), kinematics.placement(robot.frame_id).copy()
    task = CentreOfMassTask(np.zeros(3)).linearize(kinematics)
    centre = kinematics.centre_of_mass()[0]
    kept = task.J.copy(), centre.copy()
    assert np.array_equal(kinematics.jacobian(robot.frame_id), J)
    assert np.array_equal(kinematics.placement(robot.frame_id).homogeneous, X.homogeneous)
    kinematics.update(robot.q0)
    kinematics.centre_of_mass()
    assert np.array_equal(task.J, kept[0])
    assert np.array_equal(centre, kept[1])


def test_a_robot_without_mass_has_no_centre_of_it() -> None:
    """An error of one line that names the robot."""
    robot = load_robot("planar3r")
    model = pin.Model(robot.model)
    model.inertias[:] = [pin.Inertia.Zero() for _ in model.inertias]
    light = replace(robot, model=model, name="light")
    with pytest.raises(DikbenchError, match="robot light has no mass"):
        CentreOfMassTask(np.zeros(3)).linearize(_at(light, light.q0))


@pytest.mark.parametrize("target", [[0, 0], [0, 0, np.nan], "here", None])
def test_a_centre_of_mass_needs_three_finite_numbers(target: object) -> None:
    """Checked where the task is made, in one line."""
    with pytest.raises(DikbenchError, match="centre-of-mass task: expected"):
        CentreOfMassTask(target)  # type: ignore[arg-type]


# --- weights


def _weighted(kind: str, robot: Robot, weight: object) -> LinearizedTask:
    makers: dict[str, Callable[[], Task]] = {
        "posture": lambda: PostureTask(robot.q0 + 0.1, weight=weight),  # type: ignore[arg-type]
        "damping": lambda: DampingTask(weight=weight),  # type: ignore[arg-type]
        "centre": lambda: CentreOfMassTask(np.ones(3), weight=weight),  # type: ignore[arg-type]
        "pose": lambda: PoseTask(
            _placement(robot, robot.q0),
            weight=weight,  # type: ignore[arg-type]
        ),
        "position": lambda: PositionTask(np.ones(3), weight=weight),  # type: ignore[arg-type]
        "orientation": lambda: OrientationTask(np.eye(3), weight=weight),  # type: ignore[arg-type]
    }
    return makers[kind]().linearize(_at(robot, robot.q0 + 0.2))


KINDS = {"posture": 7, "damping": 7, "centre": 3, "pose": 6, "position": 3, "orientation": 3}


@pytest.mark.parametrize("kind", KINDS)
def test_weights_are_a_number_or_one_per_row(kind: str) -> None:
    """J^T W J and J^T W V with W = diag(w), for a float, an integer and a vector."""
    robot, rows = load_robot("panda"), KINDS[kind]
    for weight in (0.25, 2, np.float64(0.5), np.linspace(0, 1, rows), [0.3] * rows):
        task = _weighted(kind, robot, weight)
        W = np.diag(np.broadcast_to(weight, rows))
        square, pull = task.normal_equations()
        assert square == pytest.approx(task.J.T @ W @ task.J, abs=1e-14)
        assert pull == pytest.approx(task.J.T @ W @ task.V, abs=1e-14)


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf"), np.ones(5), "heavy", None])
@pytest.mark.parametrize("kind", KINDS)
def test_wrong_weights_are_errors_of_one_line(kind: str, weight: object) -> None:
    """Which task, what was given, and how many numbers would be valid."""
    with pytest.raises(DikbenchError, match=f"task: weight: expected a number or {KINDS[kind]}"):
        _weighted(kind, load_robot("panda"), weight)


# --- several tasks


def _task(rows: int, **kwargs: object) -> LinearizedTask:
    random = np.random.default_rng(rows)
    J, V, error = random.normal(size=(rows, 7)), random.normal(size=rows), random.normal(size=rows)
    return LinearizedTask(J, V, error, **kwargs)  # type: ignore[arg-type]


def test_stacked_tasks_are_rows_below_each_other() -> None:
    """J, V and error in the order of the tasks, weights one per row, the first's priority."""
    a = _task(2, weight=3.0, priority=2)
    b = _task(3, weight=np.array([1.0, 2.0, 4.0]), priority=2)
    both = stacked([a, b])
    assert np.array_equal(both.J, np.concatenate([a.J, b.J]))
    assert np.array_equal(both.V, np.concatenate([a.V, b.V]))
    assert np.array_equal(both.error, np.concatenate([a.error, b.error]))
    assert np.array_equal(both.weight, [3, 3, 1, 2, 4])
    assert both.priority == 2
    assert both.log_derivative is None


def test_a_single_task_is_its_own_stack() -> None:
    """Nothing is copied on the way that most laws take."""
    only = _task(2)
    assert stacked([only]) is only


def test_the_log_derivative_of_a_stack_is_block_diagonal() -> None:
    """A pose's block beside the identity of tasks that have none."""
    robot, random = load_robot("panda"), np.random.default_rng(8)
    at = _at(robot, robot.q0)
    pose = PoseTask(target=_placement(robot, _random_q(robot, random, 0.5))).linearize(at)
    posture = PostureTask(target=_random_q(robot, random), priority=1).linearize(at)
    Jl = stacked([posture, pose]).log_derivative
    assert Jl is not None
    assert Jl.shape == (13, 13)
    assert np.array_equal(Jl[:7, :7], np.eye(7))
    assert pose.log_derivative is not None
    assert np.array_equal(Jl[7:, 7:], pose.log_derivative)
    assert np.all(Jl[:7, 7:] == 0)
    assert np.all(Jl[7:, :7] == 0)


def test_a_problem_sorts_its_tasks_into_levels() -> None:
    """One stacked task per priority, the most important first, and that one is the primary."""
    robot = load_robot("panda")
    a, b, c = _task(2, priority=1), _task(3, priority=1), _task(4, priority=5)
    problem = problem_of(a, b, c, robot=robot)
    assert [len(level.V) for level in problem.levels] == [5, 4]
    assert np.array_equal(problem.primary.V, np.concatenate([a.V, b.V]))
    assert problem.levels[1] is c
    alone = problem_of(a, c, robot=robot)
    assert alone.primary is a
    shuffled = problem_of(a, c, b, robot=robot)
    assert [level.priority for level in shuffled.levels] == [1, 5]


# --- joint centring


def test_the_middle_is_half_way_between_the_limits() -> None:
    """As far from the lower as from the upper limit, NaN for a joint that lacks one."""
    robot = load_robot("planar3r").with_limits(position=([-1, -2, 0], [3, 1, np.inf]))
    np.testing.assert_array_equal(robot.limits.middle, [1.0, -0.5, np.nan])
    panda = load_robot("panda")
    assert panda.limits.middle is not None
    seen = panda.limits.at(panda.limits.middle)
    assert seen.to_lower == pytest.approx(seen.to_upper)
    assert panda.with_limits(position=None).limits.middle is None
