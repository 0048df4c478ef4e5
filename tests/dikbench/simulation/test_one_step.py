"""One control step for a person at a prompt: figures, conventions, and errors that help."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from dikbench import DikbenchError, PositionTask, PostureTask, Status, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.problem import Task

NAN = float("nan")
LP = "lp-alpha[braking=one-step,regularization=0]"
TWIST = (0.5, -1.0, 2.0, 1.0, -2.0, 3.0)
PANDA = load_robot("panda")


@pytest.mark.parametrize(
    ("twist", "reference_frame", "expected"),
    [
        ((3, 0, 0, 0, 0, 0), "LOCAL_WORLD_ALIGNED", 0.2300097),  # Drake and PlaCo give this too
        (TWIST, "LOCAL_WORLD_ALIGNED", 0.3886424),
        (TWIST, "LOCAL", 0.5724205),
    ],
)
def test_progress_of_the_panda(
    twist: tuple[float, ...], reference_frame: Any, expected: float
) -> None:
    """The LP's progress on the Panda at its start is the published one, in the axes named."""
    answer = solve_dik(
        PANDA,
        PANDA.q0,
        formulation=LP,
        twist=twist,
        reference_frame=reference_frame,
        dt=0.01,
        solver="clarabel",
    )
    assert answer.status is Status.OK
    assert answer.progress == pytest.approx(expected, abs=1e-6)
    assert answer.relaxed == 0


@pytest.mark.parametrize("name", ["ur5", "ur10"])
@pytest.mark.parametrize("reference_frame", ["LOCAL", "LOCAL_WORLD_ALIGNED", "WORLD"])
def test_reference_frames_are_pinocchios(name: str, reference_frame: Any) -> None:
    """The velocity does the twist as Pinocchio's own Jacobian in that reference frame counts it."""
    robot = load_robot(name)
    random = np.random.default_rng(0)
    for _ in range(10):
        q = robot.q0 + random.uniform(-0.3, 0.3, robot.nq)
        twist = random.normal(size=6)
        v = solve_dik(
            robot, q, formulation="pinv", twist=twist, reference_frame=reference_frame
        ).velocity
        J = pin.computeFrameJacobian(
            robot.model,
            robot.model.createData(),
            q,
            robot.model.getFrameId(robot.frame),
            getattr(pin.ReferenceFrame, reference_frame),
        )
        np.testing.assert_allclose(J @ v, twist, atol=1e-9)


def test_progress_does_not_depend_on_the_axes() -> None:
    """The same twist given in three axes is the same answer."""
    X = placement(PANDA.q0)
    local = np.array(TWIST)
    aligned = np.concatenate([X.rotation @ local[:3], X.rotation @ local[3:]])
    twists = {"LOCAL": local, "LOCAL_WORLD_ALIGNED": aligned, "WORLD": X.action @ local}
    answers = [
        solve_dik(PANDA, PANDA.q0, formulation="qp", twist=twist, reference_frame=frame)  # type: ignore[arg-type]
        for frame, twist in twists.items()
    ]
    for answer in answers[1:]:
        np.testing.assert_allclose(answer.velocity, answers[0].velocity, atol=1e-9)
        assert answer.progress == pytest.approx(answers[0].progress, abs=1e-9)


def test_frame_of_the_xarm7() -> None:
    """A frame named at loading is the one that moves."""
    robot = load_robot("xarm7", frame="link_eef")
    assert robot.frame == "link_eef"
    other = load_robot("xarm7", frame="link3")
    twist = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)
    for arm in (robot, other):
        v = solve_dik(arm, arm.q0, formulation="qp", twist=twist).velocity
        J = pin.computeFrameJacobian(
            arm.model, arm.model.createData(), arm.q0, arm.model.getFrameId(arm.frame), pin.LOCAL
        )
        moved = J @ v
        reachable = J @ np.linalg.pinv(J, rcond=1e-6) @ twist
        np.testing.assert_allclose(moved, reachable, atol=1e-3)


def test_target_is_reached_in_one_step_by_default() -> None:
    """One step of dt ends at the target up to second order: a tenth of the way, a 1/100 of miss."""
    direction = np.array([1e-3, -2e-3, 1e-3, 2e-3, 1e-3, -1e-3])
    misses = []
    for scale in (1.0, 0.1):
        target = placement(PANDA.q0) * pin.exp6(scale * direction)
        answer = solve_dik(PANDA, PANDA.q0, formulation="pinv", target=target, dt=0.01)
        assert answer.progress == pytest.approx(1.0, abs=1e-9)
        reached = placement(PANDA.q0 + 0.01 * answer.velocity)
        misses.append(float(np.linalg.norm(pin.log6(reached.actInv(target)).np)))
    assert misses[0] < 1e-2 * np.linalg.norm(direction)
    assert misses[1] == pytest.approx(1e-2 * misses[0], rel=0.05)


def test_gain_of_a_target_scales_the_velocity() -> None:
    """With gain K the wanted twist is K times the error."""
    target = placement(PANDA.q0) * pin.exp6(np.array([1e-2, 0, 0, 0, 0, 2e-2]))
    slow = solve_dik(PANDA, PANDA.q0, formulation="pinv", target=target, gain=2.0)
    fast = solve_dik(PANDA, PANDA.q0, formulation="pinv", target=target, gain=6.0)
    np.testing.assert_allclose(fast.velocity, 3 * slow.velocity, atol=1e-12)
    J = pin.computeFrameJacobian(
        PANDA.model, PANDA.model.createData(), PANDA.q0, PANDA.frame_id, pin.LOCAL
    )
    np.testing.assert_allclose(J @ slow.velocity, [2e-2, 0, 0, 0, 0, 4e-2], atol=1e-12)


def test_target_with_a_posture_task() -> None:
    """A secondary posture task moves the joints in the null space of the target's task."""
    target = placement(PANDA.q0) * pin.exp6(np.array([1e-3, 0, 0, 0, 0, 0]))
    posture = PostureTask(target=PANDA.q0 + 0.1)
    calls = [
        solve_dik(PANDA, PANDA.q0, formulation="nullspace", target=target, tasks=tasks)
        for tasks in ([], [posture])
    ]
    for answer in calls:
        assert answer.status is Status.OK
        assert answer.progress == pytest.approx(1.0, abs=1e-9)
    gained = calls[1].velocity - calls[0].velocity
    assert gained @ np.full(7, 0.1) > 1e-3  # towards the posture


def test_the_weight_of_the_target_is_that_of_its_task() -> None:
    """Against a posture of weight 1, with P = J^T W J + I: v = P^-1 (J^T W V + v_posture)."""
    twist, W = np.array([0.02, 0.01, 0, 0, 0, 0.03]), np.array([1.0, 2, 3, 4, 5, 6])
    posture = PostureTask(PANDA.q0 + 0.01, priority=1)
    J = pin.computeFrameJacobian(
        PANDA.model, PANDA.model.createData(), PANDA.q0, PANDA.frame_id, pin.LOCAL
    )
    expected = np.linalg.solve(J.T @ (W[:, None] * J) + np.eye(7), J.T @ (W * twist) + 0.01)
    formulation = "qp[damping=0]"
    answer = solve_dik(
        PANDA, PANDA.q0, formulation=formulation, twist=twist, weight=list(W), tasks=[posture]
    )
    np.testing.assert_allclose(answer.velocity, expected, atol=1e-7)


@pytest.mark.parametrize("formulation", ["hqp", "sns", "nullspace"])
def test_tasks_come_in_any_order_and_the_twist_has_a_priority(formulation: str) -> None:
    """An elbow of the first priority moves as it wants, the twist below it in what is left."""
    frame = "panda_link4"
    aside = placement(PANDA.q0, frame).translation + np.array([0.0, 0.001, 0.0])
    elbow = PositionTask(target=aside, frame=frame, priority=1)
    posture = PostureTask(PANDA.q0, priority=3)
    twist = np.array([0.02, 0.01, 0, 0, 0, 0])
    arguments: dict[str, Any] = {"formulation": formulation, "twist": twist, "priority": 2}
    orders: tuple[list[Task], ...] = ([elbow, posture], [posture, elbow])
    answers = [solve_dik(PANDA, PANDA.q0, tasks=tasks, **arguments) for tasks in orders]
    np.testing.assert_allclose(answers[0].velocity, answers[1].velocity, atol=1e-12)
    v, model = answers[0].velocity, PANDA.model
    data, index = model.createData(), model.getFrameId(frame)
    J_1 = pin.computeFrameJacobian(model, data, PANDA.q0, index, pin.LOCAL_WORLD_ALIGNED)[:3]
    np.testing.assert_allclose(J_1 @ v, [0.0, 0.001, 0.0], atol=1e-6)
    J_2 = pin.computeFrameJacobian(model, data, PANDA.q0, PANDA.frame_id, pin.LOCAL)
    N = np.eye(7) - np.linalg.pinv(J_1, rcond=1e-6) @ J_1
    missing = J_2 @ v - twist  # no motion that keeps the elbow's makes it smaller
    np.testing.assert_allclose((J_2 @ N).T @ missing, 0.0, atol=1e-4)


@pytest.mark.parametrize("formulation", ["qp", "lp-alpha"])
@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("joint", range(7))
def test_from_outside_a_limit_it_goes_back(formulation: str, side: str, joint: int) -> None:
    """Outside a limit the joint moves inside, at a tenth of its velocity limit or all the way."""
    position, velocity = PANDA.limits.position, PANDA.limits.velocity
    assert position is not None
    assert velocity is not None
    q = PANDA.q0.copy()
    sign = 1 if side == "upper" else -1
    for overshoot, speed in ((0.05, 0.1 * velocity.upper[joint]), (1e-4, 1e-4 / 0.01)):
        q[joint] = getattr(position, side)[joint] + sign * overshoot
        answer = solve_dik(PANDA, q, formulation=formulation, twist=(0.1, 0, 0, 0, 0, 0), dt=0.01)
        assert answer.status in {Status.OK, Status.INFEASIBLE, Status.STUCK}
        assert -sign * answer.velocity[joint] >= speed - 1e-6
        assert np.all(np.abs(answer.velocity) <= velocity.upper + 1e-6)


def test_nothing_wanted_has_no_progress() -> None:
    """For a zero twist the progress is NaN, and not a division by zero."""
    answer = solve_dik(PANDA, PANDA.q0, formulation="qp", twist=np.zeros(6))
    assert answer.status is Status.OK
    assert np.isnan(answer.progress)
    np.testing.assert_allclose(answer.velocity, 0, atol=1e-9)


def test_acceleration_limits_need_a_velocity_before() -> None:
    """Acceleration limits bound the change from v_prev, and nothing where v_prev is not given."""
    robot = PANDA.with_limits(acceleration=5.0)
    twist = (0.3, 0, 0, 0, 0, 0)
    free = solve_dik(robot, robot.q0, formulation="qp", twist=twist, dt=0.01).velocity
    assert np.abs(free).max() > 0.2
    v_prev = np.full(7, 0.02)
    bound = solve_dik(robot, robot.q0, formulation="qp", twist=twist, dt=0.01, v_prev=v_prev)
    assert np.abs(bound.velocity - v_prev).max() == pytest.approx(0.05, abs=1e-6)


def test_inputs_are_copied() -> None:
    """Lists, tuples and arrays are taken alike, and never changed."""
    q, twist = PANDA.q0.copy(), np.array(TWIST)
    q.setflags(write=False)
    twist.setflags(write=False)
    arrays = solve_dik(PANDA, q, formulation="dls", twist=twist).velocity
    lists = solve_dik(PANDA, list(q), formulation="dls", twist=tuple(twist)).velocity
    np.testing.assert_array_equal(arrays, lists)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "formulation": ({"formulation": "lp-alpa"}, "did you mean 'lp-alpha'.*valid:.*dikbench list"),
    "formulation without name": ({"formulation": ""}, r"name\[parameter=value"),
    "unclosed bracket": ({"formulation": "dls[damping"}, r"name\[parameter=value"),
    "parameter": ({"formulation": "dls[dampin=1]"}, "'dampin'; did you mean 'damping'.* valid:"),
    "parameter's type": (
        {"formulation": "dls[damping=x]"},
        "damping='x'.*valid: a number, finite and at least 0",
    ),
    "parameter's range": ({"formulation": "dls[damping=-1]"}, "at least 0"),
    "parameter's choice": ({"formulation": "qp[braking=hard]"}, "valid: one-step, gain, sqrt"),
    "NaN damping": ({"formulation": "qp[damping=nan]"}, "at least 0"),
    "NaN regularization": ({"formulation": "lp-alpha[regularization=nan]"}, "at least 0"),
    "NaN tolerance of pinv": ({"formulation": "pinv[rank_tolerance=nan]"}, "at least 0"),
    "NaN tolerance of nullspace": ({"formulation": "nullspace[rank_tolerance=nan]"}, "at least 0"),
    "solver": ({"formulation": "qp", "solver": "osqq"}, "'osqp'.*valid: clarabel, daqp"),
    "solver that is not needed": ({"solver": "osqq"}, "did you mean 'osqp'.*valid:"),
    "setting": ({"formulation": "qp", "solver": "osqp[eps=1]"}, "'eps'.*valid: eps_abs"),
    "setting's type": (
        {"formulation": "qp", "solver": "osqp[max_iter=few]"},
        "must be a whole number",
    ),
    "interface": (
        {"formulation": "qp", "solver": "osqp[interface=hot]"},
        "valid: cold, cvxpy, warm",
    ),
    "LP on a QP solver": ({"formulation": "lp-alpha", "solver": "proxqp"}, "linear program"),
    "cvxpy on daqp": ({"formulation": "lp-alpha-cvxpy", "solver": "daqp"}, "valid: osqp"),
    "reference frame": ({"reference_frame": "WORLDY"}, "did you mean 'WORLD'.*valid: LOCAL"),
    "five numbers of twist": ({"twist": [1.0] * 5}, r"twist: expected shape \(6,\), got \(5,\)"),
    "NaN twist": ({"twist": [NAN] * 6}, "twist: expected finite"),
    "words as twist": ({"twist": "up"}, "twist: expected 6 numbers, got 'up'"),
    "twist and target": ({"target": pin.SE3.Identity()}, "either a twist or a target"),
    "neither twist nor target": ({"twist": None}, "either a twist or a target"),
    "target's type": ({"twist": None, "target": np.eye(4)}, "pinocchio.SE3, got ndarray"),
    "NaN target": (
        {"twist": None, "target": pin.SE3(np.eye(3), np.full(3, NAN))},
        "target: expected finite",
    ),
    "reference frame of a target": (
        {"twist": None, "target": pin.SE3.Identity(), "reference_frame": "WORLD"},
        "reference_frame: belongs to a twist",
    ),
    "negative weight": ({"weight": -1.0}, "twist: weight: expected a number or 6 numbers"),
    "five weights": ({"weight": [1.0] * 5}, "twist: weight: expected a number or 6 numbers"),
    "priority of zero": ({"priority": 0}, "priority: expected 1"),
    "priority that is not looked at": (
        {"priority": 2, "tasks": [PostureTask(PANDA.q0, priority=1)]},
        "DampedLeastSquares: does not look at tasks below the first priority",
    ),
    "gain of a twist": ({"gain": 1.0}, "gain: belongs to a target"),
    "gain of zero": ({"twist": None, "target": pin.SE3.Identity(), "gain": 0}, "positive"),
    "NaN gain": ({"twist": None, "target": pin.SE3.Identity(), "gain": NAN}, "positive"),
    "dt of zero": ({"dt": 0.0}, "dt: expected a positive"),
    "NaN dt": ({"dt": NAN}, "dt: expected a positive"),
    "six joints of v_prev": ({"v_prev": [0.0] * 6}, r"v_prev: expected shape \(7,\), got \(6,\)"),
    "NaN v_prev": ({"v_prev": [NAN] * 7}, "v_prev: expected finite"),
    "six joints of q": ({"q": [0.0] * 6}, r"q: expected shape \(7,\), got \(6,\)"),
    "NaN q": ({"q": [NAN] * 7}, "q: expected finite"),
    "words as q": ({"q": "home"}, "q: expected 7 numbers, got 'home'"),
    "six joints of a posture": ({"tasks": [PostureTask(np.zeros(6))]}, r"expected shape \(7,\)"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_input_is_one_helpful_line(what: str) -> None:
    """Every wrong input is a DikbenchError of one line that says what would have been valid."""
    wrong, message = WRONG[what]
    arguments = {"q": PANDA.q0, "formulation": "dls", "twist": TWIST, **wrong}
    with pytest.raises(DikbenchError, match=message) as raised:
        solve_dik(PANDA, **arguments)
    assert "\n" not in str(raised.value)


def test_nan_posture_is_an_error() -> None:
    """A posture that is not finite is refused when the task is made."""
    with pytest.raises(DikbenchError, match="posture task: expected finite"):
        PostureTask(np.full(7, NAN))


def test_unknown_robot_and_frame_list_the_valid_ones() -> None:
    """A robot or frame that is not known is answered with those that are."""
    with pytest.raises(DikbenchError, match=r"did you mean 'panda'\? valid: .*panda, .*ur5"):
        load_robot("pandaa")
    with pytest.raises(DikbenchError, match=r"'link_eff'.*did you mean 'link_eef'\? valid:"):
        load_robot("xarm7", frame="link_eff")


def test_a_law_that_breaks_is_one_line(tmp_path: Any) -> None:
    """A law from a file that raises is an error that names what it raised."""
    file = tmp_path / "broken.py"
    file.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Broken:\n"
        "    def velocity(self, problem, solve):\n"
        "        raise KeyError('nothing')\n"
    )
    with pytest.raises(
        DikbenchError, match=r"^formulation-error: KeyError: 'nothing' \(broken\.py, line 5\)$"
    ):
        solve_dik(PANDA, PANDA.q0, formulation=f"{file}:Broken", twist=TWIST)


def placement(q: Array, frame: str = PANDA.frame) -> Any:
    """Placement of a frame of the Panda in the world."""
    data = PANDA.model.createData()
    pin.framesForwardKinematics(PANDA.model, data, q)
    return data.oMf[PANDA.model.getFrameId(frame)].copy()
