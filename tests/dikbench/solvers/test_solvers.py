"""Solvers: known programs through every interface, names and settings, and who believes them."""

from __future__ import annotations

from collections.abc import Callable

import cvxpy
import numpy as np
import pytest
from makers.programs import (
    ACCURACY,
    INSTALLED,
    LIBRARIES_WARN,
    mixture,
    no_point,
    projection,
    scaling,
    solve_with,
)

from dikbench.arrays import Array
from dikbench.errors import Infeasible, SolverFailed
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.solvers.catalogue.back_ends import (
    BACK_ENDS,
)
from dikbench.solvers.recheck.feasibility import is_feasible

pytestmark = LIBRARIES_WARN

CALLS = [f"{name}[interface={i}]" for name in INSTALLED for i in BACK_ENDS[name].interfaces]
LINEAR = [
    f"{name}[interface={i}]"
    for name in INSTALLED
    if "lp" in BACK_ENDS[name].programs
    for i in BACK_ENDS[name].interfaces
]
MODELLED = [name for name in INSTALLED if "cvxpy" in BACK_ENDS[name].interfaces]


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


def _linear() -> tuple[QuadraticProgram, Array]:
    """Max x_1 + 2 x_2 with x_1 + x_2 <= 3, 0 <= x_1, 0 <= x_2 <= 2: the vertex (1, 2)."""
    G, h = np.array([[1.0, 1.0]]), np.array([3.0])
    lower, upper = np.zeros(2), np.array([np.inf, 2.0])
    cost = np.array([-1.0, -2.0])
    return QuadraticProgram(np.zeros((2, 2)), cost, G, h, lb=lower, ub=upper), np.array([1.0, 2.0])


def _contradiction() -> QuadraticProgram:
    """The same row twice with two right-hand sides: x_1 = 0 and x_1 = 1."""
    A = np.array([[1.0, 0.0], [1.0, 0.0]])
    return QuadraticProgram(np.eye(2), np.zeros(2), A=A, b=np.array([0.0, 1.0]))


# --- known programs through every interface


@pytest.mark.parametrize("example", [projection, _equality, _half_space, mixture])
@pytest.mark.parametrize("call", CALLS)
def test_every_solver_solves_a_known_quadratic_program(
    call: str, example: Callable[[], tuple[QuadraticProgram, Array]]
) -> None:
    """Through each of its interfaces, with its own settings, to a verified answer."""
    program, x = example()
    solve = solve_with(call)
    assert solve(program) == pytest.approx(x, abs=ACCURACY)
    assert solve.rechecked().verified.tolist() == [1]


@pytest.mark.parametrize("example", [_linear, scaling])
@pytest.mark.parametrize("call", LINEAR)
def test_every_solver_that_claims_so_solves_a_known_linear_program(
    call: str, example: Callable[[], tuple[QuadraticProgram, Array]]
) -> None:
    """P = 0 and the optimum at a vertex."""
    program, x = example()
    assert solve_with(call, "lp")(program) == pytest.approx(x, abs=ACCURACY)


@pytest.mark.parametrize("name", MODELLED)
def test_a_program_in_modelling_words_gives_its_unknowns_stacked(name: str) -> None:
    """Max alpha, v = alpha (1, 4), |v| <= 2, written in cvxpy: x = (v, alpha), rechecked."""
    v, alpha = cvxpy.Variable(2), cvxpy.Variable()
    limits = [v >= -2, v <= 2, alpha >= 0, alpha <= 1]
    model = cvxpy.Problem(cvxpy.Maximize(alpha), [v == alpha * np.array([1.0, 4.0]), *limits])
    program, x = scaling()
    solve = solve_with(name, "cvxpy")
    answer = solve(ModelledProgram(model, (v, alpha), lambda: program))
    assert answer == pytest.approx(x, abs=ACCURACY)
    assert solve.rechecked().verified.tolist() == [1]
    assert solve.calls == 1


@pytest.mark.parametrize("call", CALLS)
def test_the_program_is_not_changed_by_solving_it(call: str) -> None:
    """Solvers get the law's own arrays: they must be left as they were."""
    program, _ = mixture()
    before = {part: getattr(program, part).copy() for part in program.__struct_fields__}
    solve_with(call)(program)
    for part, value in before.items():
        assert np.array_equal(getattr(program, part), value), part


@pytest.mark.parametrize("part", QuadraticProgram.__struct_fields__)
@pytest.mark.parametrize("call", CALLS)
def test_a_program_may_be_read_only(call: str, part: str) -> None:
    """Some arrays are shared between steps, and nobody can write to them."""
    program, x = mixture()
    getattr(program, part).flags.writeable = False
    assert solve_with(call)(program) == pytest.approx(x, abs=ACCURACY)


@pytest.mark.parametrize("call", CALLS)
def test_an_answer_does_not_depend_on_what_was_solved_before(call: str) -> None:
    """The same program gives the same bits after another one of the same shape."""
    program, _ = projection()
    other = QuadraticProgram(np.eye(3), np.array([9.0, -9.0, 0.1]), lb=program.lb, ub=program.ub)
    solve = solve_with(call)
    first = solve(program).copy()
    solve(other)
    assert np.array_equal(solve(program), first)


# --- infeasible, failed, lying


@pytest.mark.parametrize("call", CALLS)
def test_a_program_without_a_feasible_point_is_infeasible(call: str) -> None:
    """Bounds against an equality: every solver sees it, and the judge agrees."""
    with pytest.raises(Infeasible):
        solve_with(call)(no_point())


@pytest.mark.parametrize("call", CALLS)
def test_an_inconsistent_equality_is_never_verified(call: str) -> None:
    """Whatever a solver makes of x = 0 and x = 1: infeasible, or claimed and caught."""
    solve = solve_with(call)
    try:
        solve(_contradiction())
    except Infeasible:
        return
    found = solve.rechecked()
    assert found.verified.tolist() == [0]
    assert found.primal[0] >= 0.5 - 1e-9  # no x is nearer to both


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
    program, _ = projection()
    with pytest.raises(SolverFailed):
        solve_with(call)(program)


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
    solve = solve_with(call)
    try:
        solve(program)
    except Infeasible:
        return
    found = solve.rechecked()
    assert found.verified.tolist() == [0]
    # No J v has the lost half of a unit twist: the largest of six rows misses its share.
    assert found.primal[0] >= 0.5 / np.sqrt(6) - 1e-9


def test_the_judge_of_feasibility() -> None:
    """Crossed bounds, inconsistent equalities, empty half spaces; and programs with a point."""
    P, q = np.eye(2), np.zeros(2)
    ones = np.ones(2)
    row = np.array([[1.0, 1.0]])
    assert is_feasible(QuadraticProgram(P, q))
    assert is_feasible(QuadraticProgram(P, q, lb=ones, ub=ones))
    assert is_feasible(QuadraticProgram(P, q, G=-row, h=np.array([-5.0])))
    for example in (projection, _equality, _half_space, mixture, _linear, scaling):
        assert is_feasible(example()[0])
    assert not is_feasible(QuadraticProgram(P, q, lb=ones, ub=-ones))
    assert not is_feasible(QuadraticProgram(P, q, G=row, h=np.array([-3.0]), lb=-ones, ub=ones))
    assert not is_feasible(no_point())
    assert not is_feasible(_contradiction())


# --- residuals against hand-computed values
