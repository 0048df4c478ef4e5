"""Residuals of answers, recomputed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from makers.programs import LIBRARIES_WARN, mixture, one_bound, residuals_of

from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.catalogue.presets import TOLERANCES
from dikbench.solvers.recheck.residuals import residuals
from dikbench.solvers.recheck.stack import Stack

pytestmark = LIBRARIES_WARN


TOLERANCE = TOLERANCES["default"]
MANY = 48


def test_residuals_of_the_right_answer_are_zero() -> None:
    """The optimum that was put together from its multipliers, with these multipliers."""
    program, x = mixture()
    answer = Answer(
        x, True, y=np.array([-1.0]), z=np.array([0.5]), z_box=np.array([2.0, -3.0, 0.0])
    )
    found = residuals_of(program, answer)
    assert found.primal == pytest.approx(0.0, abs=1e-15)
    assert found.dual == pytest.approx(0.0, abs=1e-15)
    assert found.gap == pytest.approx(0.0, abs=1e-15)
    assert found.within(TOLERANCE)


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
    program, _ = mixture()
    answer = Answer(np.array(x), True, np.zeros(1), np.zeros(1), np.zeros(3))
    assert residuals_of(program, answer).primal == pytest.approx(primal)


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
    found = residuals_of(one_bound(), Answer(np.array([x]), True, z_box=np.array([multiplier])))
    assert found.dual == pytest.approx(dual)
    assert found.gap == pytest.approx(gap)
    assert found.within(TOLERANCE) == (dual == gap == 0.0)


def test_a_negative_multiplier_of_an_inequality_is_a_dual_residual() -> None:
    """-x <= 0 with min 1/2 x^2 - x: stationary at x = 0 with z = -1, which pulls, not pushes."""
    program = QuadraticProgram(np.eye(1), np.array([-1.0]), -np.eye(1), np.zeros(1))
    found = residuals_of(program, Answer(np.zeros(1), True, z=np.array([-1.0])))
    assert found.primal == 0
    assert found.dual == pytest.approx(1.0)
    assert not found.within(TOLERANCE)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_multiplier_of_an_infinite_bound_is_a_dual_residual(sign: int) -> None:
    """Stationary through a bound that does not exist: caught, and nothing becomes NaN."""
    inf = np.array([np.inf])
    program = QuadraticProgram(np.eye(1), np.array([-2.0 * sign]), lb=-inf, ub=inf)
    found = residuals_of(program, Answer(np.zeros(1), True, z_box=np.array([2.0 * sign])))
    assert found.dual == pytest.approx(2.0)
    assert found.gap == 0.0
    right = residuals_of(program, Answer(np.array([2.0 * sign]), True, z_box=np.zeros(1)))
    assert [right.primal, right.dual, right.gap] == [0.0, 0.0, 0.0]


def test_an_infinite_side_of_an_inequality_does_not_count() -> None:
    """It constrains nothing, and inf times zero is no NaN in the gap."""
    program = QuadraticProgram(
        np.eye(1), np.array([-2.0]), np.ones((2, 1)), np.array([np.inf, 1.0])
    )
    found = residuals_of(program, Answer(np.ones(1), True, z=np.array([0.0, 1.0])))
    assert [found.primal, found.dual, found.gap] == [0.0, 0.0, 0.0]


def test_dual_residuals_are_relative_to_the_cost() -> None:
    """A cost 100 times as large has a gradient 100 times as large for the same error in x."""
    small, large = (
        residuals_of(
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
    found = residuals_of(one_bound(), Answer(np.array([1.0]), True))
    assert found.primal == 0.0
    assert math.isnan(found.dual[0])
    assert math.isnan(found.gap[0])
    assert found.within(TOLERANCE)
    assert not residuals_of(one_bound(), Answer(np.array([1.1]), True)).within(TOLERANCE)


@pytest.mark.parametrize("excess", [0.5, 2.0])
def test_the_tolerance_of_verification(excess: float) -> None:
    """At most the tolerance of violation is accepted, whichever it is."""
    for tolerance in TOLERANCES.values():
        x = np.array([1.0 + excess * tolerance])
        assert residuals_of(one_bound(), Answer(x, True)).within(tolerance) == (excess < 1)


# --- many at once


def test_a_stack_gives_each_answer_its_own_residuals() -> None:
    """Programs of one structure with answers of every quality: the same as one by one."""
    random = np.random.default_rng(0)
    program, x = mixture()
    programs, answers = [], []
    for k in range(MANY):
        wrong = 10.0 ** random.uniform(-9, 0) * random.normal(size=8)
        scale = 10.0 ** random.uniform(-2, 2)
        programs.append(_scaled(program, scale))
        pushes = scale * (np.array([-1.0, 0.5, 2.0, -3.0, 0.0]) + wrong[3:])
        answers.append(Answer(x + wrong[:3], k % 2 == 0, pushes[:1], pushes[1:2], pushes[2:]))
    stacked = residuals(Stack(programs, answers))
    alone = [residuals_of(p, a) for p, a in zip(programs, answers, strict=True)]
    for part in ("primal", "dual", "gap"):
        one_by_one = [getattr(found, part)[0] for found in alone]
        assert getattr(stacked, part) == pytest.approx(one_by_one, rel=1e-9, abs=1e-13), part
    assert stacked.nearness.tolist() == [found.nearness[0] for found in alone]
    for tolerance in TOLERANCES.values():
        within = [bool(found.within(tolerance)[0]) for found in alone]
        assert stacked.within(tolerance).tolist() == within
        assert not all(within)
    assert any(found.within(TOLERANCE)[0] for found in alone)


def _scaled(program: QuadraticProgram, scale: float) -> QuadraticProgram:
    """The same program with other units of its cost."""
    P, q = scale * program.P, scale * program.q
    return QuadraticProgram(
        P, q, program.G, program.h, program.A, program.b, program.lb, program.ub
    )


# --- how near the optimum an answer must be


def test_one_soft_cost_among_stiff_ones_is_not_hidden_by_them() -> None:
    """One in 16 is looked at first; one beside it that is 10^6 times as flat still counts."""
    stiff, soft = (
        QuadraticProgram(scale * np.eye(2), np.zeros(2), lb=-np.ones(2), ub=np.ones(2))
        for scale in (1.0, 1e-6)
    )
    for place in (0, 1, MANY - 1):
        programs = [stiff] * MANY
        programs[place] = soft
        answer = Answer(np.array([0.5, 0.0]), True, z_box=np.zeros(2))
        found = residuals(Stack(programs, [answer] * len(programs)))
        assert found.nearness.min() >= 0.5
        assert found.nearness[place] < 10


def test_nothing_follows_from_residuals_that_are_not_known() -> None:
    """Infinite without multipliers, with one of the wrong sign, or with a cost that is singular."""
    one = one_bound()
    right = residuals_of(one, Answer(np.ones(1), True, z_box=np.ones(1)))
    assert right.nearness < 1e-7
    assert residuals_of(one, Answer(np.ones(1), True)).nearness == np.inf
    inequality = QuadraticProgram(np.eye(1), np.array([-1.0]), -np.eye(1), np.zeros(1))
    pulled = Answer(np.zeros(1), True, z=np.array([-1.0]))
    assert residuals_of(inequality, pulled).nearness == np.inf
    endless = QuadraticProgram(np.eye(1), np.array([-2.0]), lb=np.zeros(1), ub=np.array([np.inf]))
    vain = Answer(np.zeros(1), True, z_box=np.array([2.0]))
    assert residuals_of(endless, vain).nearness == np.inf
    flat = QuadraticProgram(np.ones((2, 2)), np.zeros(2), lb=-np.ones(2), ub=np.ones(2))
    assert (
        residuals_of(flat, Answer(np.array([0.5, -0.5]), True, z_box=np.zeros(2))).nearness
        == np.inf
    )
    lost = residuals_of(one, Answer(np.array([np.nan]), True, z_box=np.zeros(1)))
    assert lost.nearness == np.inf
    line = QuadraticProgram(np.zeros((1, 1)), np.zeros(1), lb=np.zeros(1))
    assert residuals_of(line, Answer(np.ones(1), True, z_box=np.zeros(1))).nearness == np.inf
