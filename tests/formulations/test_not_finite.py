"""A problem that holds NaN or infinity never gives a velocity that passes for an answer."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from makers.turns import in_turns

from dikbench import linear_algebra
from dikbench.arrays import Array
from dikbench.errors import CannotAnswer
from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import plugins
from dikbench.problem import DikProblem, program_of
from dikbench.simulation.control_step import TrialEnded, control_step
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from dikbench.testing import states

NAMES = sorted(plugins("formulation"))
PLACES: dict[str, Callable[[DikProblem], Array | None]] = {
    "q": lambda problem: problem.q,
    "v_prev": lambda problem: problem.v_prev,
    "J of task 1": lambda problem: problem.tasks[0].J,
    "V of task 1": lambda problem: problem.tasks[0].V,
    "error of task 1": lambda problem: problem.tasks[0].error,
    "J of task 2": lambda problem: problem.tasks[1].J,
    "V of task 2": lambda problem: problem.tasks[1].V,
    "error of task 2": lambda problem: problem.tasks[1].error,
    "G": lambda problem: problem.G,
    "h": lambda problem: problem.h,
}
"""Everything that a formulation may compute with."""


def _problem() -> DikProblem:
    """A control step with everything in it: two tasks, rows G v <= h, a motion before."""
    for state in states():
        problem = state.problem
        if len(problem.tasks) == 2 and problem.G is not None and problem.v_prev is not None:
            return problem
    raise AssertionError("no state has everything")


def _spoiled(place: str, bad: float, entry: int = -1) -> DikProblem:
    problem = _problem()
    second = problem.tasks[1]
    second.J = second.J.copy()  # that of a posture is shared, and read-only
    part = PLACES[place](problem)
    assert part is not None
    part[(entry,) * part.ndim] = bad
    problem.__post_init__()  # the stacked levels hold copies
    return problem


def _solve(name: str) -> CheckedSolve:
    program = program_of(make_formulation(name))
    return make_solve(None if program is None else parse_solver(DEFAULT_SOLVER[program]), program)


@pytest.mark.parametrize(
    ("name", "place", "bad"), in_turns(NAMES, PLACES, [np.nan, np.inf, -np.inf], every=3)
)
def test_a_problem_that_is_not_finite_ends_the_trial(name: str, place: str, bad: float) -> None:
    """As `not-finite`, and the message says what is not; an infinite h constrains nothing."""
    if place == "h" and np.isinf(bad):
        return
    with pytest.raises(TrialEnded, match=place) as ended:
        control_step(make_formulation(name), _spoiled(place, bad), _solve(name))
    assert ended.value.status is Status.NOT_FINITE


@pytest.mark.parametrize("name", NAMES)
def test_no_formulation_makes_numbers_of_what_is_none(name: str) -> None:
    """Asked without the harness, with NaN or infinity in J or V: no finite velocity, and an end."""
    places, entries = ("J of task 1", "V of task 1"), (0, -1)
    for place, bad, entry in product(places, (np.nan, np.inf), entries):
        try:
            with np.errstate(all="ignore"):
                v = make_formulation(name).velocity(_spoiled(place, bad, entry), _solve(name))
        except (CannotAnswer, ValueError):  # cvxpy takes no NaN
            continue
        assert not np.isfinite(v).all(), (place, bad, entry)


@pytest.mark.filterwarnings("ignore:overflow")
def test_an_infinite_bound_and_huge_numbers_are_finite_problems() -> None:
    """An infinite h constrains nothing, and squares that overflow are no infinity."""
    problem = _problem()
    assert problem.h is not None
    problem.h[0] = np.inf
    assert control_step(make_formulation("qp"), problem, _solve("qp")).status is Status.OK
    problem.tasks[1].V = np.full_like(problem.tasks[1].V, 1e200)
    answer = control_step(make_formulation("pinv"), problem, _solve("pinv"))
    assert answer.status is Status.OK


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_decompositions_of_what_is_not_finite_hold_no_numbers() -> None:
    """LAPACK leaves zeros behind, an inverse that is zero, or never ends."""
    b = np.ones(3)
    for bad, place in product((np.nan, np.inf), ((0, 0), (1, 2), (2, 3))):
        A = np.arange(12.0).reshape(3, 4)
        A[place] = bad
        found = [
            *linear_algebra.thin_svd(A),
            linear_algebra.pseudo_inverse(A, 1e-6),
            linear_algebra.least_norm(A, b, 1e-6),
            linear_algebra.damped_least_squares(A, b, 1e-2),
            linear_algebra.null_space(A, 1e-6),
            linear_algebra.DampedInverse(A, 1e-6, 0.1).times(b),
            linear_algebra.DampedInverse(A, 1e-6, 0.1).taken("exact"),
            *linear_algebra.inverse_and_row_space(A, 1e-6),
        ]
        for number, part in enumerate(found):
            assert np.isnan(part).any(), number
