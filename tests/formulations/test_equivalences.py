"""Laws that are the same map where theory says so, and closed forms of small cases."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from makers.problems import equation, planar_robot, problem_of, velocity_of
from scipy.optimize import lsq_linear

from dikbench import (
    PoseTask,
    PostureTask,
    Robot,
    Status,
    Task,
    load_robot,
    solve_dik,
)
from dikbench.arrays import Array
from dikbench.problem import Formulation
from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.solvers.catalogue.back_ends import BACK_ENDS, is_installed

ARMS = ("panda", "ur5", "planar3r")
TIGHT = {
    "osqp": "osqp[eps_abs=1e-10,eps_rel=1e-10,max_iter=100000]",
    "clarabel": "clarabel[tol_feas=1e-11,tol_gap_abs=1e-11,tol_gap_rel=1e-11]",
    "piqp": "piqp[eps_abs=1e-10,eps_rel=1e-10]",
    "proxqp": "proxqp[eps_abs=1e-10,eps_rel=0]",
    "daqp": "daqp[primal_tol=1e-10,dual_tol=1e-10]",
    "highs": "highs[primal_feasibility_tolerance=1e-9,dual_feasibility_tolerance=1e-9]",
    "quadprog": "quadprog",
    "scs": "scs[eps_abs=1e-10,eps_rel=1e-10,max_iters=200000]",
}


def random_states(robot: Robot, count: int, seed: int = 0) -> list[tuple[Array, Array]]:
    """Configurations inside the limits, away from singularities, with a wanted twist each."""
    position = robot.limits.position
    assert position is not None
    random = np.random.default_rng(seed)
    lower, upper = np.maximum(position.lower, -np.pi), np.minimum(position.upper, np.pi)
    kinematics = Kinematics(robot)
    found: list[tuple[Array, Array]] = []
    while len(found) < count:
        q = random.uniform(lower, upper)
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
        twist = random.normal(size=6)
        if smallest_singular_value(J) > 0.02:
            found.append((q, twist))
    return found


TWO_JOINTS = planar_robot(1.0, 1.0, velocity=1e6)
"""An arm whose limits are far away."""


def answer(law: str | Formulation, J: Array, V: Array) -> Array:
    """What a law that needs no solver gives for J v = V."""
    return velocity_of(law, problem_of(equation(J, V), robot=TWO_JOINTS))


@pytest.mark.parametrize("damping", [0.003, 0.05, 0.5])
@pytest.mark.parametrize("name", ARMS)
def test_unlimited_qp_is_damped_least_squares(name: str, damping: float) -> None:
    """Without limits the quadratic program is damped least squares with the same lambda."""
    robot = load_robot(name)
    states = random_states(robot, 20)
    robot = robot.with_limits(position=None, velocity=None)
    for q, twist in states:
        qp = solve_dik(robot, q, formulation=f"qp[damping={damping}]", twist=twist)
        dls = solve_dik(robot, q, formulation=f"dls[damping={damping}]", twist=twist)
        np.testing.assert_allclose(qp.velocity, dls.velocity, rtol=1e-7, atol=1e-8)


def test_lp_alpha_is_scaled_pseudo_inverse_on_six_joints() -> None:
    """With six joints and velocity limits alone, the LP scales as far as the pseudo-inverse."""
    robot = load_robot("ur5")
    states = random_states(robot, 200)
    robot = robot.with_limits(position=None)
    scaled = 0
    for q, twist in states:
        lp = solve_dik(robot, q, formulation="lp-alpha[regularization=0]", twist=2 * twist)
        pinv = solve_dik(robot, q, formulation="pinv[after=scale]", twist=2 * twist)
        assert lp.progress == pytest.approx(pinv.progress, abs=1e-6)
        scaled += pinv.progress < 0.99
    assert 50 < scaled < 200  # the limits were at work, and not everywhere


def test_lp_alpha_goes_further_than_scaling_on_seven_joints() -> None:
    """With a null space the LP is never slower than the scaled pseudo-inverse, often faster."""
    robot = load_robot("panda")
    states = random_states(robot, 60)
    robot = robot.with_limits(position=None)
    gains = []
    for q, twist in states:
        lp = solve_dik(robot, q, formulation="lp-alpha[regularization=0]", twist=3 * twist)
        pinv = solve_dik(robot, q, formulation="pinv[after=scale]", twist=3 * twist)
        gains.append(lp.progress - pinv.progress)
    assert min(gains) > -1e-7
    assert np.count_nonzero(np.array(gains) > 1e-3) > 30


@pytest.mark.parametrize("name", ARMS)
def test_null_space_law_of_one_task_is_the_pseudo_inverse(name: str) -> None:
    """With one task, strict priority is the pseudo-inverse."""
    robot = load_robot(name)
    for q, twist in random_states(robot, 20):
        one = solve_dik(robot, q, formulation="nullspace", twist=twist).velocity
        pinv = solve_dik(robot, q, formulation="pinv", twist=twist).velocity
        np.testing.assert_allclose(one, pinv, rtol=0, atol=1e-10)


def test_null_space_law_protects_the_first_task() -> None:
    """A posture as second task moves the joints, and the first task not at all."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    for q, twist in random_states(robot, 50):
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)
        posture = PostureTask(robot.q0, gain=5.0)
        alone = solve_dik(robot, q, formulation="nullspace", twist=twist).velocity
        both = solve_dik(robot, q, formulation="nullspace", twist=twist, tasks=[posture]).velocity
        assert np.abs(J @ both - twist).max() < 1e-9
        assert np.abs(both - alone).max() > 1e-2


@pytest.mark.parametrize("second", ["posture", "elbow"])
def test_null_space_law_does_the_second_task_as_well_as_the_first_allows(second: str) -> None:
    """Among all velocities that do the first task, the law's is the nearest to the second's."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    for q, twist in random_states(robot, 20):
        kinematics.update(q)
        elbow = kinematics.placement(robot.model.getFrameId("panda_link4")) * pin.exp6(0.1 * twist)
        task: Task = PostureTask(robot.q0, gain=5.0)
        if second == "elbow":
            task = PoseTask(elbow, gain=5.0, priority=2, frame="panda_link4")
        linear = task.linearize(kinematics)
        v = solve_dik(robot, q, formulation="nullspace", twist=twist, tasks=[task]).velocity
        assert np.abs(kinematics.jacobian(robot.frame_id) @ v - twist).max() < 1e-9
        # Stationarity: no free motion brings the second task nearer.
        free = linear.J @ np.linalg.svd(kinematics.jacobian(robot.frame_id))[2][6]
        assert abs(free @ (linear.J @ v - linear.V)) < 1e-9


def test_pseudo_inverse_does_the_task_with_the_least_motion() -> None:
    """The pseudo-inverse does the task, and moves nothing that the task leaves free."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    for q, twist in random_states(robot, 20):
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)
        v = solve_dik(robot, q, formulation="pinv", twist=twist).velocity
        np.testing.assert_allclose(J @ v, twist, atol=1e-10)
        assert np.abs(np.linalg.svd(J)[2][6:] @ v).max() < 1e-10


def test_clipping_and_scaling_to_lopsided_limits() -> None:
    """Clipping cuts each joint; scaling keeps the direction and touches the first limit."""
    lower, upper = -np.linspace(0.2, 0.8, 7), np.linspace(0.9, 0.3, 7)
    robot = load_robot("panda")
    states = random_states(robot, 20)
    robot = robot.with_limits(velocity=(lower, upper))
    for q, twist in states:
        v = solve_dik(robot, q, formulation="pinv", twist=twist).velocity
        clipped = solve_dik(robot, q, formulation="pinv[after=clip]", twist=twist).velocity
        scaled = solve_dik(robot, q, formulation="pinv[after=scale]", twist=twist).velocity
        np.testing.assert_array_equal(clipped, np.clip(v, lower, upper))
        share = float(scaled @ v) / float(v @ v)
        np.testing.assert_allclose(scaled, share * v, atol=1e-12)
        assert np.all(scaled >= lower - 1e-12)
        assert np.all(scaled <= upper + 1e-12)
        assert min(np.abs(scaled - lower).min(), np.abs(scaled - upper).min()) < 1e-12


def test_weight_multiplies_the_squared_norm_of_a_task() -> None:
    """Two weighted tasks are least squares whose rows are scaled by the root of their weight."""
    robot = load_robot("panda")
    states = random_states(robot, 20)
    robot = robot.with_limits(position=None, velocity=None)
    kinematics = Kinematics(robot)
    posture = PostureTask(robot.q0, gain=2.0, weight=np.linspace(0.1, 0.7, 7))
    for q, twist in states:
        kinematics.update(q)
        root = np.sqrt(np.linspace(0.1, 0.7, 7))
        rows = np.vstack([kinematics.jacobian(robot.frame_id), np.diag(root)])
        wanted = np.concatenate([twist, root * 2.0 * (robot.q0 - q)])
        reference = np.linalg.lstsq(rows, wanted)[0]
        qp = solve_dik(robot, q, formulation="qp[damping=0]", twist=twist, tasks=[posture])
        np.testing.assert_allclose(qp.velocity, reference, atol=1e-8)


@pytest.mark.parametrize("name", [name for name in TIGHT if is_installed(name)])
def test_tight_solvers_agree_with_an_active_set_method(name: str) -> None:
    """Every solver at tight tolerance finds the QP's minimum, known from bounded least squares."""
    robot = load_robot("panda")
    assert robot.limits.velocity is not None
    limit = robot.limits.velocity.upper
    damping = 0.05
    kinematics = Kinematics(robot)
    active = 0
    states = random_states(robot, 10)
    robot = robot.with_limits(position=None)
    for q, twist in states:
        kinematics.update(q)
        stacked = np.vstack([kinematics.jacobian(robot.frame_id), damping * np.eye(robot.nv)])
        wanted = np.concatenate([3 * twist, np.zeros(robot.nv)])
        reference = lsq_linear(stacked, wanted, (-limit, limit), method="bvls", tol=1e-14).x
        law = f"qp[damping={damping}]"
        qp = solve_dik(robot, q, formulation=law, twist=3 * twist, solver=TIGHT[name])
        assert qp.status is Status.OK
        np.testing.assert_allclose(qp.velocity, reference, rtol=0, atol=2e-4)
        active += int(np.count_nonzero(np.abs(reference) > limit - 1e-9))
    assert active > 10  # else any least squares would do


def test_every_solver_has_a_tight_setting_here() -> None:
    """No solver of the catalogue is left out of the comparison above."""
    assert TIGHT.keys() == BACK_ENDS.keys()


@pytest.mark.parametrize("name", ["panda", "ur5"])
def test_lp_alpha_in_two_interfaces(name: str) -> None:
    """Alpha scaling in matrices and in cvxpy's words give the same alpha, slow or fast."""
    robot = load_robot(name)
    alphas = []
    for number, (q, twist) in enumerate(random_states(robot, 30)):
        wanted = (0.1, 1.0, 4.0)[number % 3] * twist
        alpha, other = (
            solve_dik(robot, q, formulation=law, twist=wanted, solver="clarabel").progress
            for law in ("lp-alpha", "lp-alpha-cvxpy")
        )
        assert other == pytest.approx(alpha, abs=1e-6)
        alphas.append(alpha)
    assert 0.01 < min(alphas) < 0.5
    assert max(alphas) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("eps", [1.0, 0.1, 1e-3])
def test_nearly_lost_direction_in_closed_form(eps: float) -> None:
    """J = diag(1, eps), V = (0, 1): the inverse asks for 1/eps, the damped one for less."""
    J, V = np.diag([1.0, eps]), np.array([0.0, 1.0])
    damping = 0.05
    np.testing.assert_allclose(answer("pinv", J, V), [0, 1 / eps], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        answer(f"dls[damping={damping}]", J, V),
        [0, eps / (eps**2 + damping**2)],
        rtol=1e-12,
        atol=1e-12,
    )


def test_lost_direction_in_closed_form() -> None:
    """J = diag(1, 0): what cannot be done is left out, with damping or without."""
    J, V = np.diag([1.0, 0.0]), np.array([0.5, 1.0])
    np.testing.assert_allclose(answer("pinv", J, V), [0.5, 0], atol=1e-15)
    np.testing.assert_allclose(answer("dls[damping=0]", J, V), [0.5, 0], atol=1e-15)
    np.testing.assert_allclose(answer("dls[damping=0.5]", J, V), [0.4, 0], atol=1e-15)


@given(
    J=arrays.arrays(
        float, st.tuples(st.integers(1, 6), st.integers(1, 7)), elements=st.floats(-5, 5)
    ),
    damping=st.floats(1e-2, 1.0),
    data=st.data(),
)
@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.too_slow])
def test_damped_least_squares_is_bounded(J: Array, damping: float, data: st.DataObject) -> None:
    """|v| <= |V| / (2 lambda), whatever the Jacobian."""
    V = data.draw(arrays.arrays(float, len(J), elements=st.floats(-10, 10)))
    v = answer(f"dls[damping={damping!r}]", J, V)
    # Squares of numbers below 1e-154 underflow.
    assert np.linalg.norm(v) <= np.linalg.norm(V) / (2 * damping) * (1 + 1e-9) + 1e-150


@pytest.mark.parametrize("damping", [0.01, 0.2])
def test_bound_of_damped_least_squares_is_attained(damping: float) -> None:
    """The bound |V| / (2 lambda) is met where the singular value is lambda."""
    v = answer(f"dls[damping={damping}]", np.diag([1.0, damping]), np.array([0.0, 1.0]))
    assert np.linalg.norm(v) == pytest.approx(1 / (2 * damping), rel=1e-12)
