"""Solvers: known programs through every interface, names and settings, and who believes them."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable

import cvxpy
import numpy as np
import pytest

from dikbench.array import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.kinematics import Kinematics
from dikbench.modelled_program import ModelledProgram
from dikbench.quadratic_program import Program, QuadraticProgram
from dikbench.robot_catalogue import load_robot
from dikbench.solvers.answer import Answer
from dikbench.solvers.catalogue import (
    BACK_ENDS,
    DEFAULT_SOLVER,
    INTERFACES,
    Solver,
    is_installed,
    parse_solver,
    why_not,
)
from dikbench.solvers.checked import CheckedSolve, NoSolve, make_solve
from dikbench.solvers.feasibility import is_feasible
from dikbench.solvers.optimum import distance_to_optimum
from dikbench.solvers.residuals import VERIFIED_TOLERANCE, residuals

# The libraries warn beside each failure; `dikbench.solvers` silences them, pytest resets that.
pytestmark = [
    pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\."),
    pytest.mark.filterwarnings(r"ignore::UserWarning:cvxpy\.|dikbench\.solvers\.modelled"),
]

INSTALLED = [name for name in BACK_ENDS if is_installed(name)]
CALLS = [f"{name}[interface={i}]" for name in INSTALLED for i in BACK_ENDS[name].interfaces]
LINEAR = [
    f"{name}[interface={i}]"
    for name in INSTALLED
    if "lp" in BACK_ENDS[name].programs
    for i in BACK_ENDS[name].interfaces
]
MODELLED = [name for name in INSTALLED if "cvxpy" in BACK_ENDS[name].interfaces]

ACCURACY = 5e-3
"""The loosest default tolerance (OSQP's 1e-3), with room for the conditioning of the examples."""


def _solve(selector: str, program: Program = "qp") -> CheckedSolve:
    return make_solve(parse_solver(selector), program)


def _projection() -> tuple[QuadraticProgram, Array]:
    """The point of the box [0, 1]^3 that is nearest to c: c clipped."""
    c = np.array([0.5, 2.0, -3.0])
    return QuadraticProgram(np.eye(3), -c, lb=np.zeros(3), ub=np.ones(3)), np.clip(c, 0, 1)


def _equality() -> tuple[QuadraticProgram, Array]:
    """Min 1/2 |x|^2_P + q x on A x = b: by elimination, x = z + P^-1 A^T (A P^-1 A^T)^-1 (b - A z).

    with z = -P^-1 q the minimiser without the equality.
    """
    P, q = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -2.0])
    A, b = np.array([[1.0, 1.0]]), np.array([1.0])
    inverse = np.linalg.inv(P)
    free = -inverse @ q
    x = free + inverse @ A.T @ np.linalg.inv(A @ inverse @ A.T) @ (b - A @ free)
    return QuadraticProgram(P, q, A=A, b=b), x


def _half_space() -> tuple[QuadraticProgram, Array]:
    """The point of {n x <= h} that is nearest to c: c - (n c - h) n / |n|^2, bounds one-sided."""
    c, n, h = np.array([2.0, 1.0, 0.5]), np.array([1.0, 2.0, -1.0]), 1.0
    x = c - (n @ c - h) * n / (n @ n)
    lower, upper = np.array([-np.inf, -9.0, -np.inf]), np.array([9.0, np.inf, np.inf])
    return QuadraticProgram(np.eye(3), -c, G=n[None], h=np.array([h]), lb=lower, ub=upper), x


def _mixture() -> tuple[QuadraticProgram, Array]:
    """Everything at once, the optimum put together from its multipliers.

    x = (1, 0, 0.5): the upper bound of x_1 active (multiplier 2), the lower one of x_2 (-3), the
    inequality x_1 + x_3 <= 1.5 active (0.5) and x_1 + x_2 - x_3 = 0.5 (-1), so that
    q = -(P x + G'z + A'y + w).
    """
    P, x = np.diag([1.0, 2.0, 4.0]), np.array([1.0, 0.0, 0.5])
    G, A = np.array([[1.0, 0.0, 1.0]]), np.array([[1.0, 1.0, -1.0]])
    q = -(P @ x + G.T @ [0.5] + A.T @ [-1.0] + np.array([2.0, -3.0, 0.0]))
    bounds = {"lb": np.array([-1.0, 0.0, -1.0]), "ub": np.array([1.0, 1.0, 1.0])}
    return QuadraticProgram(P, q, G, np.array([1.5]), A, np.array([0.5]), **bounds), x


def _linear() -> tuple[QuadraticProgram, Array]:
    """Max x_1 + 2 x_2 with x_1 + x_2 <= 3, 0 <= x_1, 0 <= x_2 <= 2: the vertex (1, 2)."""
    G, h = np.array([[1.0, 1.0]]), np.array([3.0])
    lower, upper = np.zeros(2), np.array([np.inf, 2.0])
    cost = np.array([-1.0, -2.0])
    return QuadraticProgram(np.zeros((2, 2)), cost, G, h, lb=lower, ub=upper), np.array([1.0, 2.0])


def _scaling() -> tuple[QuadraticProgram, Array]:
    """The shape of alpha scaling: max alpha, v = alpha (1, 4), |v| <= 2: alpha = 1/2."""
    A = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, -4.0]])
    bounds = {"lb": np.array([-2.0, -2.0, 0.0]), "ub": np.array([2.0, 2.0, 1.0])}
    program = QuadraticProgram(
        np.zeros((3, 3)), np.array([0.0, 0.0, -1.0]), A=A, b=np.zeros(2), **bounds
    )
    return program, np.array([0.5, 2.0, 0.5])


def _no_point() -> QuadraticProgram:
    """x_1 + x_2 = 3 with |x_i| <= 1."""
    A = np.array([[1.0, 1.0]])
    return QuadraticProgram(
        np.eye(2), np.zeros(2), A=A, b=np.array([3.0]), lb=-np.ones(2), ub=np.ones(2)
    )


def _contradiction() -> QuadraticProgram:
    """The same row twice with two right-hand sides: x_1 = 0 and x_1 = 1."""
    A = np.array([[1.0, 0.0], [1.0, 0.0]])
    return QuadraticProgram(np.eye(2), np.zeros(2), A=A, b=np.array([0.0, 1.0]))


# --- known programs through every interface


@pytest.mark.parametrize("example", [_projection, _equality, _half_space, _mixture])
@pytest.mark.parametrize("call", CALLS)
def test_every_solver_solves_a_known_quadratic_program(
    call: str, example: Callable[[], tuple[QuadraticProgram, Array]]
) -> None:
    """Through each of its interfaces, with its own settings, to a verified answer."""
    program, x = example()
    solve = _solve(call)
    assert solve(program) == pytest.approx(x, abs=ACCURACY)
    assert solve.verified


@pytest.mark.parametrize("example", [_linear, _scaling])
@pytest.mark.parametrize("call", LINEAR)
def test_every_solver_that_claims_so_solves_a_known_linear_program(
    call: str, example: Callable[[], tuple[QuadraticProgram, Array]]
) -> None:
    """P = 0 and the optimum at a vertex."""
    program, x = example()
    assert _solve(call, "lp")(program) == pytest.approx(x, abs=ACCURACY)


@pytest.mark.parametrize("name", MODELLED)
def test_a_program_in_modelling_words_gives_its_unknowns_stacked(name: str) -> None:
    """Max alpha, v = alpha (1, 4), |v| <= 2, written in cvxpy: x = (v, alpha), rechecked."""
    v, alpha = cvxpy.Variable(2), cvxpy.Variable()
    limits = [v >= -2, v <= 2, alpha >= 0, alpha <= 1]
    model = cvxpy.Problem(cvxpy.Maximize(alpha), [v == alpha * np.array([1.0, 4.0]), *limits])
    program, x = _scaling()
    solve = _solve(name, "cvxpy")
    answer = solve(ModelledProgram(model, (v, alpha), lambda: program))
    assert answer == pytest.approx(x, abs=ACCURACY)
    assert solve.verified
    assert solve.calls == 1


@pytest.mark.parametrize("call", CALLS)
def test_the_program_is_not_changed_by_solving_it(call: str) -> None:
    """Solvers get the law's own arrays: they must be left as they were."""
    program, _ = _mixture()
    before = {part: getattr(program, part).copy() for part in program.__slots__}
    _solve(call)(program)
    for part, value in before.items():
        assert np.array_equal(getattr(program, part), value), part


@pytest.mark.parametrize("call", CALLS)
def test_an_answer_does_not_depend_on_what_was_solved_before(call: str) -> None:
    """The same program gives the same bits after another one of the same shape."""
    program, _ = _projection()
    other = QuadraticProgram(np.eye(3), np.array([9.0, -9.0, 0.1]), lb=program.lb, ub=program.ub)
    solve = _solve(call)
    first = solve(program).copy()
    solve(other)
    assert np.array_equal(solve(program), first)


# --- infeasible, failed, lying


@pytest.mark.parametrize("call", CALLS)
def test_a_program_without_a_feasible_point_is_infeasible(call: str) -> None:
    """Bounds against an equality: every solver sees it, and the judge agrees."""
    with pytest.raises(Infeasible):
        _solve(call)(_no_point())


@pytest.mark.parametrize("call", CALLS)
def test_an_inconsistent_equality_is_never_verified(call: str) -> None:
    """Whatever a solver makes of x = 0 and x = 1: infeasible, or claimed and caught."""
    solve = _solve(call)
    try:
        solve(_contradiction())
    except Infeasible:
        return
    assert not solve.verified
    assert solve.primal >= 0.5 - 1e-9  # no x is nearer to both


LIMIT_OF_ITERATIONS = {
    "osqp": "max_iter",
    "clarabel": "max_iter",
    "piqp": "max_iter",
    "proxqp": "max_iter",
    "daqp": "iter_limit",
    "highs": "qp_iteration_limit",
    "scs": "max_iters",
}


@pytest.mark.parametrize(
    "call",
    [
        f"{name}[interface={i},{setting}=1]"
        for name, setting in LIMIT_OF_ITERATIONS.items()
        if name in INSTALLED
        for i in BACK_ENDS[name].interfaces
    ],
)
def test_a_solver_that_gives_up_on_a_feasible_program_has_failed(call: str) -> None:
    """One iteration is not enough for a projection onto a box: SolverFailed, not Infeasible."""
    program, _ = _projection()
    with pytest.raises(SolverFailed):
        _solve(call)(program)


@pytest.mark.parametrize("direction", [0, 1, 2, 3, 4])
@pytest.mark.parametrize("call", CALLS)
def test_the_exact_wrist_singularity_is_never_verified(call: str, direction: int) -> None:
    """The known false success: J v = V at the UR5's exact wrist, V partly outside J's range."""
    robot = load_robot("ur5")
    kinematics = Kinematics(robot)
    kinematics.update(np.array([0.3, -1.2, 1.4, -1.0, 0.0, 0.2]))
    J = kinematics.jacobian(robot.frame_id)
    U, singular, _ = np.linalg.svd(J)
    assert singular[-1] < 1e-12
    V = 0.5 * U[:, -1] + 0.3 * U[:, direction]
    bound = np.full(6, 3.0)
    program = QuadraticProgram(1e-6 * np.eye(6), np.zeros(6), A=J, b=V, lb=-bound, ub=bound)
    assert not is_feasible(program)
    solve = _solve(call)
    try:
        solve(program)
    except Infeasible:
        return
    assert not solve.verified
    # No J v has the lost half of a unit twist: the largest of six rows misses its share.
    assert solve.primal >= 0.5 / np.sqrt(6) - 1e-9


def test_the_judge_of_feasibility() -> None:
    """Crossed bounds, inconsistent equalities, empty half spaces; and programs with a point."""
    P, q = np.eye(2), np.zeros(2)
    ones = np.ones(2)
    row = np.array([[1.0, 1.0]])
    assert is_feasible(QuadraticProgram(P, q))
    assert is_feasible(QuadraticProgram(P, q, lb=ones, ub=ones))
    assert is_feasible(QuadraticProgram(P, q, G=-row, h=np.array([-5.0])))
    for example in (_projection, _equality, _half_space, _mixture, _linear, _scaling):
        assert is_feasible(example()[0])
    assert not is_feasible(QuadraticProgram(P, q, lb=ones, ub=-ones))
    assert not is_feasible(QuadraticProgram(P, q, G=row, h=np.array([-3.0]), lb=-ones, ub=ones))
    assert not is_feasible(_no_point())
    assert not is_feasible(_contradiction())


# --- residuals against hand-computed values


def test_residuals_of_the_right_answer_are_zero() -> None:
    """The optimum that was put together from its multipliers, with these multipliers."""
    program, x = _mixture()
    answer = Answer(
        x, True, y=np.array([-1.0]), z=np.array([0.5]), z_box=np.array([2.0, -3.0, 0.0])
    )
    found = residuals(program, answer)
    assert found.primal == pytest.approx(0.0, abs=1e-15)
    assert found.dual == pytest.approx(0.0, abs=1e-15)
    assert found.gap == pytest.approx(0.0, abs=1e-15)
    assert found.verified


@pytest.mark.parametrize(
    ("x", "primal"),
    [
        ([1.0, 0.0, 0.5], 0.0),
        ([1.25, 0.0, 0.25], 0.5),  # the equality by 0.5, the bound by 0.25
        ([1.0, -0.75, -0.25], 0.75),  # the lower bound
        ([1.0, 0.5, 1.0], 0.5),  # the inequality
        ([2.0, 0.0, 1.5], 2.0),  # the inequality by 2, bounds by 1 and 0.5
    ],
)
def test_the_primal_residual_is_the_worst_violation(x: list[float], primal: float) -> None:
    """Of equalities, inequalities and bounds alike."""
    program, _ = _mixture()
    answer = Answer(np.array(x), True, np.zeros(1), np.zeros(1), np.zeros(3))
    assert residuals(program, answer).primal == pytest.approx(primal)


def _one_bound() -> QuadraticProgram:
    """Min 1/2 x^2 - 2 x on [0, 1]: x = 1 with the multiplier 1 of the upper bound."""
    return QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.ones(1))


@pytest.mark.parametrize(
    ("x", "multiplier", "dual", "gap"),
    [
        (1.0, 1.0, 0.0, 0.0),
        (1.0, -1.0, 2.0, 1.0),  # wrong sign: gradient 1 - 2 - 1; gap 1*(1 - 2) + 0*(-1)
        (1.0, 0.0, 1.0, 1.0),  # no multiplier: gradient 1 - 2
        (0.5, 1.5, 0.0, 0.75),  # stationary but not complementary: -0.75 + 1.5
    ],
)
def test_dual_residual_and_gap_of_a_bound(
    x: float, multiplier: float, dual: float, gap: float
) -> None:
    """By hand: |x - 2 + z| and |x (x - 2) + ub z+ + lb z-|."""
    found = residuals(_one_bound(), Answer(np.array([x]), True, z_box=np.array([multiplier])))
    assert found.dual == pytest.approx(dual)
    assert found.gap == pytest.approx(gap)
    assert found.verified == (dual == gap == 0.0)


def test_a_negative_multiplier_of_an_inequality_is_a_dual_residual() -> None:
    """-x <= 0 with min 1/2 x^2 - x: stationary at x = 0 with z = -1, which pulls, not pushes."""
    program = QuadraticProgram(np.eye(1), np.array([-1.0]), -np.eye(1), np.zeros(1))
    found = residuals(program, Answer(np.zeros(1), True, z=np.array([-1.0])))
    assert found.primal == 0
    assert found.dual == pytest.approx(1.0)
    assert not found.verified


@pytest.mark.parametrize("sign", [1, -1])
def test_a_multiplier_of_an_infinite_bound_is_a_dual_residual(sign: int) -> None:
    """Stationary through a bound that does not exist: caught, and nothing becomes NaN."""
    inf = np.array([np.inf])
    program = QuadraticProgram(np.eye(1), np.array([-2.0 * sign]), lb=-inf, ub=inf)
    found = residuals(program, Answer(np.zeros(1), True, z_box=np.array([2.0 * sign])))
    assert found.dual == pytest.approx(2.0)
    assert found.gap == 0.0
    right = residuals(program, Answer(np.array([2.0 * sign]), True, z_box=np.zeros(1)))
    assert (right.primal, right.dual, right.gap) == (0.0, 0.0, 0.0)


def test_an_infinite_side_of_an_inequality_does_not_count() -> None:
    """It constrains nothing, and inf times zero is no NaN in the gap."""
    program = QuadraticProgram(
        np.eye(1), np.array([-2.0]), np.ones((2, 1)), np.array([np.inf, 1.0])
    )
    found = residuals(program, Answer(np.ones(1), True, z=np.array([0.0, 1.0])))
    assert (found.primal, found.dual, found.gap) == (0.0, 0.0, 0.0)


def test_dual_residuals_are_relative_to_the_cost() -> None:
    """A cost 100 times as large has a gradient 100 times as large for the same error in x."""
    small, large = (
        residuals(
            QuadraticProgram(scale * np.eye(1), np.array([-scale]), lb=-np.ones(1), ub=np.ones(1)),
            Answer(np.array([0.5]), True, z_box=np.zeros(1)),
        )
        for scale in (1.0, 100.0)
    )
    assert small.dual == pytest.approx(0.5)
    assert large.dual == pytest.approx(small.dual)
    assert large.gap == pytest.approx(small.gap)


def test_unknown_multipliers_leave_the_dual_unknown() -> None:
    """NaN, and the verdict rests on the primal residual alone."""
    found = residuals(_one_bound(), Answer(np.array([1.0]), True))
    assert found.primal == 0.0
    assert math.isnan(found.dual)
    assert math.isnan(found.gap)
    assert found.verified
    assert not residuals(_one_bound(), Answer(np.array([1.1]), True)).verified


@pytest.mark.parametrize("excess", [0.5, 2.0])
def test_the_tolerance_of_verification(excess: float) -> None:
    """At most VERIFIED_TOLERANCE of violation is accepted."""
    x = np.array([1.0 + excess * VERIFIED_TOLERANCE])
    assert residuals(_one_bound(), Answer(x, True)).verified == (excess < 1)


# --- the checked call


class _Script:
    """A back end that reads its answers off a list."""

    def __init__(self, *answers: Answer) -> None:
        self.answers = list(answers)

    def __call__(self, program: object) -> Answer:
        return self.answers.pop(0)


def _said(x: float, multiplier: float | None = None, *, claimed: bool = True) -> Answer:
    z_box = None if multiplier is None else np.array([multiplier])
    return Answer(np.array([x]), claimed, z_box=z_box, core_ns=1000)


def test_counters_add_up_over_a_step_and_start_anew() -> None:
    """Calls and nanoseconds are sums, residuals the worst of the step, all forgotten after it."""
    solve = CheckedSolve(_Script(_said(1.0, 1.0), _said(1.25, 0.75), _said(1.0, 1.0)))
    solve(_one_bound())
    assert (solve.calls, solve.core_ns, solve.verified) == (1, 1000, True)
    solve(_one_bound())
    solve(_one_bound())
    assert (solve.calls, solve.core_ns) == (3, 3000)
    assert solve.primal == pytest.approx(0.25)
    assert solve.dual == pytest.approx(0.0)
    assert solve.gap == pytest.approx(abs(1.25 * -0.75 + 0.75))
    assert not solve.verified  # one lie in a step is enough
    assert solve.solve_ns > 0
    assert solve.checking_ns > 0
    solve.begin_step()
    assert (solve.calls, solve.solve_ns, solve.core_ns, solve.checking_ns) == (0, 0, 0, 0)
    assert (solve.primal, solve.dual, solve.gap) == (0.0, 0.0, 0.0)
    assert solve.verified


@pytest.mark.parametrize("unknown_first", [True, False])
def test_unknown_residuals_of_a_step_stay_unknown(unknown_first: bool) -> None:
    """A solver that gives no multipliers is not recorded as one without a dual residual."""
    answers = [_said(1.0), _said(1.0, 1.0)]
    solve = CheckedSolve(_Script(*(answers if unknown_first else answers[::-1])))
    solve(_one_bound())
    solve(_one_bound())
    assert math.isnan(solve.dual)
    assert math.isnan(solve.gap)
    assert solve.primal == 0.0
    assert solve.verified


def test_a_flat_cost_hides_nothing() -> None:
    """Half a rad/s beside the optimum where the gradient is 5e-5: the distance says so."""
    program = QuadraticProgram(np.diag([1.0, 1e-4]), np.array([-1.0, -1e-4]))
    beside = Answer(np.array([1.0, 1.5]), True)
    assert residuals(program, beside).verified
    solve = CheckedSolve(_Script(beside, Answer(np.array([1.0, 1.0]), True)))
    solve(program)
    assert solve.distance == pytest.approx(0.5)
    assert not solve.verified
    solve.begin_step()
    solve(program)
    assert solve.distance == pytest.approx(0.0, abs=1e-9)
    assert solve.verified


def test_the_distance_of_an_alpha_scaling_is_in_alpha() -> None:
    """Four fifths of the best alpha is 0.1 of 0.5 away, however far the velocities are."""
    program, x = _scaling()
    for share, distance in ((1.0, 0.0), (0.8, 0.1)):
        answer = Answer(share * x, True)
        assert distance_to_optimum(program, answer) == pytest.approx(distance, abs=1e-6)


def test_without_a_judge_the_distance_is_not_known() -> None:
    """A program without a feasible point has no optimum to be far from."""
    assert math.isnan(distance_to_optimum(_no_point(), Answer(np.ones(2), True)))


def test_a_lie_is_handed_out_and_recorded() -> None:
    """The law gets what the solver claimed; the record says that it is not verified."""
    solve = CheckedSolve(_Script(_said(7.0, 0.0)))
    assert solve(_one_bound()) == pytest.approx([7.0])
    assert solve.primal == pytest.approx(6.0)
    assert not solve.verified


def test_an_answer_that_is_not_claimed_is_not_handed_out() -> None:
    """However good it is: SolverFailed on a feasible program, Infeasible on the other."""
    solve = CheckedSolve(_Script(_said(1.0, 1.0, claimed=False), Answer(None, True)))
    with pytest.raises(SolverFailed, match="gave no answer to a feasible program"):
        solve(_one_bound())
    with pytest.raises(Infeasible, match="no feasible point"):
        solve(_no_point())
    assert solve.calls == 2
    assert solve.checking_ns > 0
    assert solve.verified  # nothing was claimed: nothing to be caught


def test_without_a_program_solving_is_an_error() -> None:
    """A law that declares none gets a solve that says what to declare."""
    for solve in (make_solve(None, None), make_solve(None, "qp"), make_solve(_osqp(), None)):
        assert isinstance(solve, NoSolve)
        with pytest.raises(DikbenchError, match="set program = 'qp' or 'lp'"):
            solve(_one_bound())


def _osqp() -> Solver:
    return parse_solver("osqp")


# --- names and settings


def test_a_selector_names_a_solver_its_interface_and_its_settings() -> None:
    """Settings come out in their types; those not named are the library's."""
    assert parse_solver("osqp") == Solver("osqp", "cold", {})
    assert parse_solver(" osqp[ eps_abs = 1e-6 ] ") == Solver("osqp", "cold", {"eps_abs": 1e-6})
    solver = parse_solver("osqp[interface=cvxpy,max_iter=77,polishing=true]")
    assert solver == Solver("osqp", "cvxpy", {"max_iter": 77, "polishing": True})
    assert type(solver.settings["max_iter"]) is int
    assert parse_solver("scs").interface == "cvxpy"


def test_our_own_settings_are_defaults_that_a_user_replaces() -> None:
    """HiGHS gets an iteration limit from us, which a selector overrides."""
    assert parse_solver("highs").settings["qp_iteration_limit"] == 1000
    assert parse_solver("highs[qp_iteration_limit=7]").settings["qp_iteration_limit"] == 7


@pytest.mark.parametrize(
    ("selector", "message"),
    [
        ("oqsp", r"unknown solver 'oqsp'; did you mean 'osqp'\? valid: clarabel, daqp"),
        ("", "not of the form"),
        ("osqp[eps=1e-6]", r"setting of solver osqp 'eps';.* valid: eps_abs, eps_rel, interface"),
        ("osqp[eps_abs=small]", r"solver osqp: eps_abs must be of type float, got 'small'"),
        ("osqp[max_iter=1.5]", r"solver osqp: max_iter must be of type int, got '1.5'"),
        ("osqp[polishing=maybe]", r"solver osqp: polishing must be of type bool, got 'maybe'"),
        ("osqp[interface=wram]", r"interface of solver osqp 'wram'; valid: cold, cvxpy"),
        ("daqp[interface=cvxpy]", r"interface of solver daqp 'cvxpy'; valid: cold"),
        ("osqp[eps_abs]", "'eps_abs' is not parameter=value"),
        ("osqp[eps_abs=1,eps_abs=2]", "'eps_abs' is given twice"),
    ],
)
def test_wrong_selectors_are_errors_of_one_line(selector: str, message: str) -> None:
    """Each says what was wrong and what would have been valid."""
    with pytest.raises(DikbenchError, match=message) as caught:
        parse_solver(selector)
    assert "\n" not in str(caught.value)


def test_a_solver_that_is_not_installed_says_how_to_install_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By the name under which the package index knows it."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(DikbenchError, match=r"'proxqp' is not installed: pip install proxsuite"):
        parse_solver("proxqp")


@pytest.mark.parametrize(
    ("name", "interface", "key"),
    [
        (name, interface, key)
        for name in INSTALLED
        for interface in BACK_ENDS[name].interfaces
        for key in BACK_ENDS[name].settings
    ],
)
def test_every_setting_in_the_catalogue_is_taken(name: str, interface: str, key: str) -> None:
    """Each solver takes each of its settings through each interface and still solves."""
    value = {float: "1e-6", int: "2000", bool: "true"}[BACK_ENDS[name].settings[key]]
    program, x = _projection()
    solve = _solve(f"{name}[interface={interface},{key}={value}]")
    assert solve(program) == pytest.approx(x, abs=ACCURACY)


def test_a_tighter_tolerance_reaches_the_library() -> None:
    """OSQP at 1e-9 is nearer to the solution than at 1e-2, on a program that needs iterations."""
    program, x = _mixture()
    loose, tight = (
        np.abs(_solve(f"osqp[eps_abs={eps},eps_rel={eps}]")(program) - x).max()
        for eps in (1e-2, 1e-9)
    )
    assert tight < 1e-7 < loose


def test_which_solver_can_take_which_program() -> None:
    """The reason names the valid ones, or what is missing; an empty one means that it can."""
    assert why_not(parse_solver("daqp"), "qp") == ""
    assert why_not(parse_solver("daqp"), "lp") == ""
    assert why_not(parse_solver("proxqp"), "qp") == ""
    assert why_not(parse_solver("proxqp"), "lp").startswith("proxqp cannot take a linear program")
    assert why_not(parse_solver("clarabel"), "cvxpy") == ""
    reason = why_not(parse_solver("daqp"), "cvxpy")
    assert reason == "daqp is not called through cvxpy here; valid: osqp, clarabel, highs, scs"


def test_the_catalogue_is_consistent() -> None:
    """Interfaces are known ones, defaults can do what they are for, gaps have their reason."""
    for name, back_end in BACK_ENDS.items():
        assert back_end.interfaces
        assert set(back_end.interfaces) <= set(INTERFACES), name
        assert set(back_end.ours) <= set(back_end.settings), name
        assert ("lp" in back_end.programs) == (not back_end.no_lp), name
    for program, name in DEFAULT_SOLVER.items():
        assert why_not(parse_solver(name), program) == ""
