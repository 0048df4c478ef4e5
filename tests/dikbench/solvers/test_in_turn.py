"""A second solver that is asked where the first gives no answer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.errors import DikbenchError, Infeasible, SolverFailed
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.selector import parse_selector
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, Solver, parse_solver, why_not
from dikbench.solvers.checked_solve import make_solve
from dikbench.study.identity import timing_id

pytestmark = pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\.")

DATA = Path(__file__).parents[2] / "data" / "programs_without_answer.npz"
"""Feasible programs of control steps, to which daqp gave no answer when they were recorded: where
they come from / the part of the program."""


def _recorded() -> dict[str, QuadraticProgram]:
    parts: dict[str, dict[str, Array]] = {}
    with np.load(DATA) as data:
        for key in data.files:
            name, _, part = key.partition("/")
            parts.setdefault(name, {})[part] = data[key]
    return {name: QuadraticProgram(**given) for name, given in parts.items()}


RECORDED = _recorded()


@pytest.mark.parametrize("name", RECORDED)
def test_the_default_solver_answers_where_daqp_does_not(name: str) -> None:
    """And its answer passes the recheck."""
    solve = make_solve(parse_solver(DEFAULT_SOLVER["lp"]), "lp")
    solve.begin_run(1)
    solve.begin_step(0)
    assert np.isfinite(solve(RECORDED[name])).all()
    rechecked = solve.rechecked()
    assert rechecked.verified.tolist() == [1]
    assert rechecked.claimed.tolist() == [1]
    assert solve.calls == 1


def test_daqp_alone_stays_alone() -> None:
    """Else the recorded programs would show nothing: it has no answer to most of them."""
    solve = make_solve(parse_solver("daqp"), "lp")
    failed = 0
    for program in RECORDED.values():
        try:
            solve(program)
        except SolverFailed:
            failed += 1
    assert failed >= len(RECORDED) / 2


@pytest.mark.parametrize("interface", ["cold", "warm"])
def test_both_calls_are_timed_and_the_answer_is_rechecked(interface: str) -> None:
    """The time in the libraries is that of both, and more than the second alone takes."""
    n = 6
    random = np.random.default_rng(0)
    G = random.normal(size=(20, n))
    program = QuadraticProgram(np.eye(n), 10 * random.normal(size=n), G, np.ones(20))
    second = parse_solver(f"clarabel[interface={interface}]")
    x = make_solve(second, "qp")(program)
    solve = make_solve(
        parse_solver(f"daqp[interface={interface},iter_limit=1,then=clarabel]"), "qp"
    )
    solve.begin_run(1)
    solve.begin_step(0)
    assert solve(program) == pytest.approx(x, abs=1e-6)
    assert 0 < solve.core_ns <= solve.solve_ns
    assert solve.rechecked().verified.tolist() == [1]


def test_a_program_without_a_point_has_no_answer_from_both() -> None:
    """It is infeasible, whoever says so."""
    program = QuadraticProgram(np.eye(2), np.ones(2), lb=np.ones(2), ub=np.zeros(2))
    with pytest.raises(Infeasible):
        make_solve(parse_solver("daqp[then=clarabel]"), "qp")(program)


def test_the_second_solver_has_the_preset_and_the_interface_that_are_given() -> None:
    """And none of the settings, which are the first one's."""
    parsed = parse_solver("daqp[interface=warm,preset=high,iter_limit=7,then=clarabel]")
    assert parsed.then == parse_solver("clarabel[interface=warm,preset=high]")
    assert parsed.settings["iter_limit"] == 7
    assert parse_solver("daqp[then=clarabel]").then == Solver("clarabel", "cold", {})
    assert parse_solver("daqp").then is None


@pytest.mark.parametrize(
    ("selector", "message"),
    [
        ("daqp[then=daqp]", "then names the same solver"),
        ("daqp[then=clarabell]", r"unknown solver 'clarabell' .*; did you mean 'clarabel'\?"),
        ("daqp[interface=warm,then=quadprog]", "quadprog.*(valid: cold|pip install quadprog)"),
    ],
)
def test_a_wrong_second_solver_is_an_error_of_one_line(selector: str, message: str) -> None:
    """Whatever is wrong with it."""
    with pytest.raises(DikbenchError, match=message) as caught:
        parse_solver(selector)
    assert "\n" not in str(caught.value)


def test_both_must_be_able_to_take_the_program() -> None:
    """The reason is that of whoever cannot."""
    assert "proxqp cannot take" in why_not(parse_solver("daqp[then=proxqp]"), "lp")
    assert "proxqp cannot take" in why_not(parse_solver("proxqp[then=daqp]"), "lp")
    assert why_not(parse_solver("proxqp[then=daqp]"), "qp") == ""


def test_results_know_the_second_solver() -> None:
    """With another one, or without, it is another trial."""
    formulation, scenario = parse_selector("qp"), parse_selector("reach")
    ids = {
        timing_id(formulation, parse_selector(solver), scenario)
        for solver in ("daqp", "daqp[then=clarabel]", "daqp[then=piqp]", "clarabel[then=daqp]")
    }
    assert len(ids) == 4
