"""Names and settings of solvers, and what each can take."""

from __future__ import annotations

import importlib.util
from typing import get_args

import numpy as np
import pytest
from makers.programs import ACCURACY, INSTALLED, LIBRARIES_WARN, mixture, projection, solve_with

from dikbench.errors import DikbenchError
from dikbench.solvers.catalogue.back_end import Interface
from dikbench.solvers.catalogue.back_ends import (
    BACK_ENDS,
    DEFAULT_SOLVER,
    Solver,
    parse_solver,
    why_not,
)

pytestmark = LIBRARIES_WARN


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
        ("oqsp", r"unknown solver 'oqsp' .*; did you mean 'osqp'\? valid: clarabel, daqp"),
        ("", "not of the form"),
        ("osqp[eps=1e-6]", r"setting of solver osqp 'eps';.* valid: eps_abs, eps_rel, interface"),
        (
            "osqp[eps_abs=small]",
            r"solver osqp: eps_abs must be a number, finite and at least 0, got 'small'",
        ),
        (
            "osqp[max_iter=1.5]",
            r"solver osqp: max_iter must be a whole number, finite and at least 1, got '1.5'",
        ),
        ("osqp[polishing=maybe]", r"solver osqp: polishing must be true or false, got 'maybe'"),
        (
            "osqp[interface=wram]",
            r"interface of solver osqp 'wram'; did you mean 'warm'\? valid: cold, cvxpy, warm$",
        ),
        ("daqp[interface=cvxpy]", r"interface of solver daqp 'cvxpy'; valid: cold, warm$"),
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
    program, x = projection()
    solve = solve_with(f"{name}[interface={interface},{key}={value}]")
    assert solve(program) == pytest.approx(x, abs=ACCURACY)


def test_a_tighter_tolerance_reaches_the_library() -> None:
    """OSQP at 1e-9 is nearer to the solution than at 1e-2, on a program that needs iterations."""
    program, x = mixture()
    loose, tight = (
        np.abs(solve_with(f"osqp[eps_abs={eps},eps_rel={eps}]")(program) - x).max()
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
    assert "takes matrices" in why_not(parse_solver("clarabel[interface=warm]"), "cvxpy")
    reason = why_not(parse_solver("daqp"), "cvxpy")
    assert reason == "daqp is not called through cvxpy here; valid: osqp, clarabel, highs, scs"


def test_the_catalogue_is_consistent() -> None:
    """Interfaces are known ones, defaults can do what they are for, gaps have their reason."""
    for name, back_end in BACK_ENDS.items():
        assert back_end.interfaces
        assert set(back_end.interfaces) <= set(get_args(Interface)), name
        assert set(back_end.own_defaults) <= set(back_end.settings), name
        assert ("lp" in back_end.programs) == (not back_end.no_lp), name
    for program, name in DEFAULT_SOLVER.items():
        assert why_not(parse_solver(name), program) == ""
