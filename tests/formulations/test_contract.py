"""The contract suite on every registered formulation."""

from __future__ import annotations

import typing
from collections.abc import Iterator
from functools import lru_cache
from typing import Literal

import pytest
from makers.few_states import few_states

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import plugins
from dikbench.problem import program_of
from dikbench.testing import (
    CHECKS,
    Asked,
    Check,
    check_formulation,
    check_inputs_untouched,
    check_picklable,
    check_repeatable,
    check_sight,
)

LAWS = sorted(plugins("formulation"))


def variants(*, every: bool) -> Iterator[str]:
    """Every law with each other value of each of its switches (a Literal or a bool).

    Or with one other value of each switch, in turns from law to law.
    """
    for place, name in enumerate(LAWS):
        law = make_formulation(name)
        if program_of(law) == "cvxpy":  # slow, and the same law in other words
            continue
        for parameter, kind in typing.get_type_hints(type(law)).items():
            values = typing.get_args(kind) if typing.get_origin(kind) is Literal else ()
            values = ("false", "true") if kind is bool else values
            others = [v for v in values if str(v) != str(getattr(law, parameter)).lower()]
            for number, value in enumerate(others):
                if every or number == place % len(others):
                    yield f"{name}[{parameter}={value}]"


@lru_cache(maxsize=1)
def asked(name: str) -> Asked:
    """A law that is asked once for all its checks, which follow each other."""
    return Asked(make_formulation(name))


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("name", LAWS)
def test_registered_law_keeps_the_contract(name: str, check: Check) -> None:
    """Every registered law keeps every clause of the contract, at one state in so many."""
    with few_states(LAWS.index(name)):
        check(make_formulation(name) if check in ASK_AGAIN else asked(name), None)


@pytest.mark.long
@pytest.mark.parametrize("name", LAWS)
def test_registered_law_keeps_every_clause_at_every_state(name: str) -> None:
    """The same, without turns."""
    check_formulation(make_formulation(name))


ASK_AGAIN = (check_sight, check_inputs_untouched, check_repeatable, check_picklable)
"""Checks that ask a law again at its states; the others share one answer at each."""


@pytest.mark.parametrize(("turn", "selector"), [*enumerate(variants(every=False))])
def test_switched_law_keeps_the_contract(turn: int, selector: str) -> None:
    """Every law keeps the contract with each of its switches in another position.

    Of the checks that ask it again each has one, in turns.
    """
    once = Asked(make_formulation(selector))
    with few_states(turn):
        for check in CHECKS:
            if check not in ASK_AGAIN:
                check(once, None)
        ASK_AGAIN[turn % len(ASK_AGAIN)](make_formulation(selector), None)


@pytest.mark.long
@pytest.mark.parametrize("selector", [*variants(every=True)])
def test_switched_law_keeps_every_clause_of_the_contract(selector: str) -> None:
    """The same, without turns."""
    check_formulation(make_formulation(selector))


DAMPED = (
    "nullspace[damping=0.1,projector=damped]",
    "nullspace-robust[damping=0.1,projector=damped]",
    "joint-centering[damping=0.1,projector=damped]",
    "weighted-least-norm[damping=0.1]",
)
OTHER_WAYS = [*((law, None) for law in DAMPED), ("qp", "osqp"), ("qp", "piqp")]
"""Laws that are not damped by default, and solvers of other kinds than the default."""


@pytest.mark.parametrize(
    ("turn", "selector", "solver"), [(turn, *way) for turn, way in enumerate(OTHER_WAYS)]
)
def test_law_keeps_the_contract_in_other_ways(turn: int, selector: str, solver: str | None) -> None:
    """With damping, and through another solver; at one state in so many."""
    with few_states(turn):
        check_formulation(make_formulation(selector), solver)


@pytest.mark.long
@pytest.mark.parametrize(("selector", "solver"), OTHER_WAYS)
def test_law_keeps_every_clause_in_other_ways(selector: str, solver: str | None) -> None:
    """The same, at all states."""
    check_formulation(make_formulation(selector), solver)


@pytest.mark.parametrize(("turn", "solver"), [*enumerate(["clarabel", "osqp", "scs", "highs"])])
def test_cvxpy_remembers_nothing(turn: int, solver: str) -> None:
    """Solvers behind cvxpy start afresh although its compiled problems are shared and kept."""
    with few_states(turn):
        check_repeatable(make_formulation("lp-alpha-cvxpy"), solver)


def test_solver_that_cannot_is_an_error() -> None:
    """A solver that cannot take the law's program is an error of the caller, not of the law."""
    with pytest.raises(DikbenchError, match="cannot take a linear program"):
        check_formulation(make_formulation("lp-alpha"), "proxqp")
