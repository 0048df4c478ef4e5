"""What laws promise holds with every solver that they can take, afresh or from where it was."""

from __future__ import annotations

from functools import cache

import msgspec
import pytest

from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import plugins
from dikbench.problem import Formulation, program_of, promises_of
from dikbench.simulation.control_step import control_step
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import (
    BACK_ENDS,
    Solver,
    is_installed,
    parse_solver,
    why_not,
)
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.solvers.checked_solve import make_solve
from dikbench.testing import CHECKS, LIMIT_TOLERANCE_RAD_S, assert_within
from dikbench.testing.states import State, states

# What a solver grumbles about is in its answer's status.
pytestmark = [
    pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\."),
    pytest.mark.filterwarnings(r"ignore::UserWarning:cvxpy\.|dikbench\.solvers\.modelled"),
]

LAWS = [name for name in sorted(plugins("formulation")) if program_of(make_formulation(name))]
SOLVERS = [f"{name}[interface={way}]" for name in BACK_ENDS for way in BACK_ENDS[name].interfaces]
STRIDE = 13
"""One state in so many is asked in the normal run. No period of the states divides it: all speeds,
limits, rows and motions before come up."""


TO_THE_BIT = {"check_repeatable", "check_picklable"}
"""Not asked of proxqp: its answers to the same numbers are up to 1e-14 rad/s apart, as its matrices
lie in memory."""


@cache
def every_state() -> list[State]:
    """The states of the contract, robot by robot."""
    return list(states())


def asked(law: str, selector: str) -> tuple[Formulation, Solver]:
    """A law and a solver; skips one that is not installed."""
    name = selector.partition("[")[0]
    if not is_installed(name):
        pytest.skip(f"{name} is not installed")
    return make_formulation(law), parse_solver(selector)


def can_work(law: str, selector: str) -> bool:
    """Whether the solver takes the law's programs.

    A law in cvxpy's words calls the solver through cvxpy, whatever the interface.
    """
    name, program = selector.partition("[")[0], program_of(make_formulation(law))
    assert program is not None
    if not is_installed(name):
        return True  # shown as skipped
    solver = parse_solver(selector)
    return not why_not(solver, program) and (program != "cvxpy" or solver.interface == "cvxpy")


PAIRS = [(law, solver) for law in LAWS for solver in SOLVERS if can_work(law, solver)]
IN_TURNS = [
    pytest.param(law, solver, marks=() if place % 2 == 0 else pytest.mark.long)
    for place, (law, solver) in enumerate(PAIRS)
]
"""Every law with every solver that takes its programs; the normal run has every second pair."""


def kept_promises(formulation: Formulation, solver: Solver, stride: int) -> int:
    """Assert every promise at every so many states; the number of verified answers.

    A warm solver starts each state from the one before, on the same robot; others forget.
    """
    program, answered = program_of(formulation), 0
    solve, robot = make_solve(solver, program), ""
    for label, problem in every_state()[::stride]:
        if solver.interface != "warm" or problem.robot.name != robot:
            solve, robot = make_solve(solver, program), problem.robot.name
        solve.begin_run(1)
        state = State(label, msgspec.structs.replace(problem, relaxed=0))
        outcome, verdicts = control_step(formulation, state.problem, solve), solve.rechecked()
        if outcome.status is not Status.OK or verdicts.lied[0]:
            continue
        answered += 1
        tolerance = LIMIT_TOLERANCE_RAD_S + solve.calls * float(verdicts.primal[0])
        for kind in promises_of(formulation):
            assert_within(state, kind, outcome.velocity, tolerance)
    return answered


@pytest.mark.parametrize(("law", "solver"), IN_TURNS)
def test_promises_are_kept_with_every_solver(law: str, solver: str) -> None:
    """At every state with a verified answer, and there are some; unverified ones are not judged."""
    assert kept_promises(*asked(law, solver), STRIDE) >= 3


@pytest.mark.long
@pytest.mark.parametrize("preset", [preset for preset in TOLERANCES if preset != "default"])
@pytest.mark.parametrize(("law", "solver"), PAIRS)
def test_promises_are_kept_with_every_preset(law: str, solver: str, preset: str) -> None:
    """At all states, from loose tolerances to tight ones."""
    kept_promises(*asked(law, solver.replace("]", f",preset={preset}]")), 1)


@pytest.mark.long
@pytest.mark.parametrize(("law", "solver"), PAIRS)
def test_contract_is_kept_with_every_solver(law: str, solver: str) -> None:
    """Every clause of it, asked of a solver that remembers nothing."""
    formulation, known = asked(law, solver)
    for check in CHECKS:
        if known.name != "proxqp" or check.__name__ not in TO_THE_BIT:
            check(formulation, solver)
