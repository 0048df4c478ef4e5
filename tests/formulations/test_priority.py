"""Laws with priorities: what the second task does to the first, and when two laws are one."""

from __future__ import annotations

import functools

import numpy as np
import pinocchio as pin
import pytest

from dikbench import LinearizedTask, PoseTask, PostureTask, Robot, load_robot
from dikbench.array import Array
from dikbench.control_step import control_step
from dikbench.kinematics import Kinematics
from dikbench.planar_arm import planar_arm
from dikbench.problem import DikProblem, program_of
from dikbench.registry import make_formulation, plugins
from dikbench.robot import model_limits
from dikbench.solvers.catalogue import parse_solver
from dikbench.solvers.checked import make_solve
from dikbench.status import Status

STRICT = {"nullspace", "nullspace-robust", "sns", "sns-optimal"}
STRICT |= {"nullspace[damping=0.05]", "nullspace-robust[damping=0.05]"}
LEAKING = {
    "nullspace[damping=0.05,projector=damped]",
    "nullspace-robust[damping=0.05,projector=damped]",
    "nullspace-unprojected",
    "qp",
}


@functools.cache
def seven_joints() -> Robot:
    """An arm of seven joints whose limits are far away."""
    model = planar_arm((0.2,) * 7, velocity_limit=1e9)
    robot = Robot("planar7r", model, "tip", model_limits(model), np.zeros(7), (0, 1))
    return robot.with_limits(position=None)


def problem_of(*levels: tuple[Array, Array]) -> DikProblem:
    """A control step with tasks J v = V in numbers, one per priority."""
    robot = seven_joints()
    tasks = [
        LinearizedTask(J, V, np.zeros(len(V)), 1.0, priority)
        for priority, (J, V) in enumerate(levels, start=1)
    ]
    return DikProblem(robot, robot.q0, None, 0.01, tasks, robot.limits.at(robot.q0))


def ask(law: str, problem: DikProblem) -> Array | None:
    """What a law answers; None where it has no answer."""
    formulation = make_formulation(law)
    program = program_of(formulation)
    solve = make_solve(None if program is None else parse_solver("daqp"), program)
    outcome = control_step(formulation, problem, solve)
    return outcome.velocity if outcome.status is Status.OK else None


def answer(law: str, *levels: tuple[Array, Array]) -> Array:
    """What a law answers to tasks in numbers."""
    v = ask(law, problem_of(*levels))
    assert v is not None
    return v


def random_levels(random: np.random.Generator, *rows: int) -> list[tuple[Array, Array]]:
    """Tasks of so many rows for seven joints."""
    return [(random.normal(size=(m, 7)), random.normal(size=m)) for m in rows]


def orthogonal_levels(random: np.random.Generator, *rows: int) -> list[tuple[Array, Array]]:
    """Likewise with J_i J_k^T = 0."""
    basis = np.linalg.qr(random.normal(size=(7, 7)))[0]
    blocks = np.split(basis[: sum(rows)], np.cumsum(rows)[:-1])
    return [(random.normal(size=(len(b), len(b))) @ b, random.normal(size=len(b))) for b in blocks]


@pytest.mark.parametrize("law", ["nullspace-robust", "nullspace-unprojected", "sns", "sns-optimal"])
@pytest.mark.parametrize("rows", [(4,), (3, 2), (2, 2, 2)])
def test_orthogonal_tasks_do_not_meet(law: str, rows: tuple[int, ...]) -> None:
    """Where J_i J_k^T = 0 every priority law is the strict one, and every task is done."""
    random = np.random.default_rng(1)
    for _ in range(20):
        levels = orthogonal_levels(random, *rows)
        v = answer(law, *levels)
        np.testing.assert_allclose(v, answer("nullspace", *levels), rtol=1e-6, atol=1e-8)
        for J, V in levels:
            np.testing.assert_allclose(J @ v, V, atol=1e-8)


@pytest.mark.parametrize("law", ["nullspace", "sns", "sns-optimal"])
@pytest.mark.parametrize("rows", [(3, 2), (2, 2, 2), (1, 6)])
def test_independent_tasks_are_all_done(law: str, rows: tuple[int, ...]) -> None:
    """Without conflict and without active bounds the strict laws are one, and do every task."""
    random = np.random.default_rng(2)
    for _ in range(20):
        levels = random_levels(random, *rows)
        v = answer(law, *levels)
        for J, V in levels:
            np.testing.assert_allclose(J @ v, V, atol=1e-7)
        np.testing.assert_allclose(v, answer("nullspace", *levels), rtol=1e-6, atol=1e-7)


def test_robust_law_pays_with_the_second_task() -> None:
    """Tasks that are independent but not orthogonal: the first is done, the second not quite."""
    random = np.random.default_rng(3)
    missed = []
    for _ in range(50):
        first, second = random_levels(random, 3, 2)
        v = answer("nullspace-robust", first, second)
        np.testing.assert_allclose(first[0] @ v, first[1], atol=1e-9)
        missed.append(float(np.linalg.norm(second[0] @ v - second[1])))
    assert np.median(missed) > 0.1


@pytest.mark.parametrize("nearness", [1e-2, 1e-4])
def test_robust_law_stays_bounded_where_tasks_become_dependent(nearness: float) -> None:
    """At an algorithmic singularity the strict law grows as 1/distance, the robust one does not."""
    random = np.random.default_rng(4)
    (J1, V1), (_, V2) = random_levels(random, 3, 1)
    second = (J1[:1] + nearness * random.normal(size=(1, 7)), V2)
    strict, robust = (answer(law, (J1, V1), second) for law in ("nullspace", "nullspace-robust"))
    bound = sum(np.linalg.norm(np.linalg.pinv(J) @ V) for J, V in ((J1, V1), second))
    assert np.linalg.norm(robust) <= bound
    assert np.linalg.norm(strict) > 0.1 / nearness
    np.testing.assert_allclose(J1 @ robust, V1, atol=1e-9)


def test_unprojected_law_does_the_last_task() -> None:
    """The last task of the unprojected law is the one that is done; a posture leaves nothing."""
    random = np.random.default_rng(5)
    for _ in range(20):
        levels = random_levels(random, 3, 2, 2)
        v = answer("nullspace-unprojected", *levels)
        np.testing.assert_allclose(levels[-1][0] @ v, levels[-1][1], atol=1e-9)
        assert np.abs(levels[0][0] @ v - levels[0][1]).max() > 1e-2
    posture = (np.eye(7), random.normal(size=7))
    v = answer("nullspace-unprojected", levels[0], posture)
    np.testing.assert_allclose(v, posture[1], atol=1e-12)


def leak_of_a_posture(law: str) -> float:
    """Largest motion of the Panda's frame, at rest at its safe start, per unit of posture motion.

    In 2-norm, over all directions of the posture.
    """
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    J = kinematics.jacobian(robot.frame_id)
    rest = (J, np.zeros(6))
    return float(np.linalg.norm([J @ answer(law, rest, (np.eye(7), e)) for e in np.eye(7)], 2))


@pytest.mark.parametrize(("damping", "leak"), [(0.01, 4.5e-4), (0.05, 1.1e-2), (0.1, 3.8e-2)])
def test_damped_projector_leaks_what_theory_says(damping: float, leak: float) -> None:
    """||J (I - J_dls J)|| = max s d^2/(s^2 + d^2) over the singular values s of J.

    The robust law does not invert the projector: 4.5e-4, 1.1e-2, 3.8e-2. The strict one does, and
    with n = d^2/(s^2 + d^2) leaks max s n/(n^2 + d^2): 4.3, 2.5, 1.7.
    """
    singular = [1.80753731, 1.6754543, 1.14921852, 0.34169484, 0.30488921, 0.22105995]
    left = [damping**2 / (s**2 + damping**2) for s in singular]
    robust = leak_of_a_posture(f"nullspace-robust[damping={damping},projector=damped]")
    undamped = robust * (1 + damping**2)  # of the posture, whose own inverse is damped, too
    assert undamped == pytest.approx(max(s * n for s, n in zip(singular, left, strict=True)), 1e-6)
    assert undamped == pytest.approx(leak, rel=0.03)
    strict = leak_of_a_posture(f"nullspace[damping={damping},projector=damped]")
    inverted = [s * n / (n**2 + damping**2) for s, n in zip(singular, left, strict=True)]
    assert strict == pytest.approx(max(inverted), rel=1e-6)
    for law in ("nullspace", "nullspace-robust"):
        assert leak_of_a_posture(f"{law}[damping={damping}]") < 1e-12


def test_without_damping_the_projectors_are_the_same() -> None:
    """At lambda = 0 the switch changes nothing."""
    random = np.random.default_rng(6)
    levels = random_levels(random, 3, 2, 1)
    for law in ("nullspace", "nullspace-robust"):
        exact, damped = (answer(f"{law}[projector={p}]", *levels) for p in ("exact", "damped"))
        np.testing.assert_allclose(damped, exact, atol=1e-9)


@pytest.mark.parametrize("law", ["nullspace", "nullspace-robust", "joint-centering"])
def test_damped_law_without_a_second_task_is_damped_least_squares(law: str) -> None:
    """One task, nothing to centre: `dls` with the same lambda."""
    random = np.random.default_rng(7)
    for _ in range(10):
        level = random_levels(random, 4)[0]
        np.testing.assert_allclose(
            answer(f"{law}[damping=0.3]", level), answer("dls[damping=0.3]", level), atol=1e-12
        )


def test_joint_centring_with_a_damped_projector_leaks() -> None:
    """Joint centring under damping: the exact projector keeps the task's part, the damped moves it.

    The difference is the centring motion through J (I - J_dls J).
    """
    robot = load_robot("panda")
    problem = panda_problem(robot, robot.q0 + 0.1, np.zeros(6), ())
    J = problem.tasks[0].J
    damping = 0.1
    exact, leaking = (
        ask(f"joint-centering[damping={damping},projector={p}]", problem)
        for p in ("exact", "damped")
    )
    assert exact is not None
    assert leaking is not None
    _, middle = robot.limits.middle
    leak = J @ (np.eye(7) - J.T @ np.linalg.solve(J @ J.T + damping**2 * np.eye(6), J))
    np.testing.assert_allclose(J @ exact, np.zeros(6), atol=1e-12)
    np.testing.assert_allclose(J @ leaking, leak @ (middle - robot.q0 - 0.1), atol=1e-12)


def panda_problem(
    robot: Robot, q: Array, twist: Array, below: tuple[str, ...], v_prev: Array | None = None
) -> DikProblem:
    """A control step of the Panda: a twist, and below it an elbow to be moved or a posture."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    tasks = [LinearizedTask(kinematics.jacobian(robot.frame_id).copy(), twist, np.zeros(6))]
    if "elbow" in below:
        there = kinematics.placement(robot.model.getFrameId("panda_link4")) * pin.exp6(0.2 * twist)
        elbow = PoseTask(there, gain=5.0, priority=2, frame="panda_link4")
        tasks.append(elbow.linearize(kinematics))
    if "posture" in below:
        tasks.append(PostureTask(robot.q0, gain=5.0, priority=3).linearize(kinematics))
    return DikProblem(robot, q.copy(), v_prev, 0.01, tasks, robot.limits.at(q))


def worst_leak(law: str, bounds: str, below: tuple[str, ...]) -> tuple[float, float, int]:
    """How far lower tasks move the first one, over 60 seeded states of the Panda.

    Returns:
        Largest ||J_1 v - J_1 v_alone||, how far v moved at most, and in how many states a bound
        was met; v_alone is the answer to the first task alone.
    """
    robot = load_robot("panda")
    position = robot.limits.position
    assert position is not None
    random = np.random.default_rng(8)
    scale = {"far": 0.1, "near": 3.0, "acceleration": 1.0}[bounds]
    if bounds == "far":
        robot = robot.with_limits(position=None, velocity=1e3)
    if bounds == "acceleration":
        robot = robot.with_limits(acceleration=robot.available_acceleration)
    leak, moved, met, answered = 0.0, 0.0, 0, 0
    for _ in range(60):
        q = random.uniform(position.lower, position.upper)
        twist = scale * random.normal(size=6)
        v_prev = 0.05 * random.normal(size=7)
        alone = ask(law, panda_problem(robot, q, twist, (), v_prev))
        problem = panda_problem(robot, q, twist, below, v_prev)
        both = ask(law, problem)
        if alone is None or both is None:
            assert alone is both is None
            continue
        answered += 1
        box = problem.box()
        met += bool(np.any(np.minimum(both - box.lower, box.upper - both) < 1e-9))
        leak = max(leak, float(np.linalg.norm(problem.tasks[0].J @ (both - alone))))
        moved = max(moved, float(np.abs(both - alone).max()))
    assert answered > 10
    return leak, moved, met


BELOW = [("posture",), ("elbow",), ("elbow", "posture")]


@pytest.mark.parametrize("below", BELOW, ids="+".join)
@pytest.mark.parametrize("bounds", ["far", "near", "acceleration"])
@pytest.mark.parametrize("law", sorted(STRICT))
def test_strict_priority_is_strict(law: str, bounds: str, below: tuple[str, ...]) -> None:
    """Lower tasks move the joints, and the first task by less than 1e-9, bounds active or not."""
    leak, moved, met = worst_leak(law, bounds, below)
    assert leak < 1e-9
    assert moved > 1e-3
    if bounds != "far" and "sns" in law:
        assert met > 20


@pytest.mark.parametrize("bounds", ["far", "near"])
@pytest.mark.parametrize("law", sorted(LEAKING))
def test_weak_priority_leaks(law: str, bounds: str) -> None:
    """Laws without strict priority leak into the first task where tasks are in conflict.

    Worst ||J_1 v - J_1 v_alone|| over 60 states of the Panda, in m/s and rad/s; twist of 0.1 per
    row with limits far away | of 3 per row with the robot's own; below it a posture at 5/s, then
    an elbow. The strict laws: at most 5e-12.

    | law | posture, far | elbow, far | posture, near | elbow, near |
    |---|---|---|---|---|
    | nullspace[damping=0.05,projector=damped] | 50 | 1.6 | 82 | 47 |
    | nullspace-robust[damping=0.05,projector=damped] | 0.34 | 0.018 | 0.34 | 0.53 |
    | nullspace-unprojected | 38 | 5.2 | 42 | 160 |
    | qp (weight 1 each) | 9.4 | 0.30 | 8.1 | 5.2 |
    """
    leak, _, _ = worst_leak(law, bounds, ("posture",))
    assert leak > 0.1


@pytest.mark.parametrize("law", sorted(LEAKING))
def test_weak_priority_does_not_leak_between_orthogonal_tasks(law: str) -> None:
    """Where J_1 J_2^T = 0 there is nothing to protect: the first task is done as if it were alone.

    A damped inverse of J_1 stays in the row space of J_1, and a weighted sum falls into two.
    """
    random = np.random.default_rng(9)
    for _ in range(20):
        first, second = orthogonal_levels(random, 3, 3)
        alone, both = answer(law, first), answer(law, first, second)
        np.testing.assert_allclose(first[0] @ both, first[0] @ alone, atol=1e-6)
        assert np.abs(both - alone).max() > 1e-2


def test_every_law_without_a_solver_is_strict_blind_or_known_to_leak() -> None:
    """No law gives way to a second task unnoticed: what is not listed must not move at all."""
    for name in sorted(plugins("formulation")):
        if program_of(make_formulation(name)) is None and name not in STRICT | LEAKING:
            leak, moved, _ = worst_leak(name, "far", ("elbow", "posture"))
            assert (leak, moved) == (0.0, 0.0), name
