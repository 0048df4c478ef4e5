"""What a formulation solved itself is rechecked where it hands it over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest

from dikbench.arrays import Array
from dikbench.metrics import Measured, measure
from dikbench.problem import DikProblem, QuadraticProgram, Solve
from dikbench.report.sentences.limitations import _not_rechecked
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.lockstep import LockstepTrial, simulate_together
from dikbench.solvers.checked_solve import make_solve
from dikbench.solvers.many_solve import ManySolve
from dikbench.testing.motions import slow_line

N = 3


def program(scale: float = 1.0) -> QuadraticProgram:
    """Min |x - scale|^2 / 2 with x <= 0.5: x = 0.5, with the multiplier scale - 0.5."""
    return QuadraticProgram(np.eye(N), -scale * np.ones(N), ub=np.full(N, 0.5))


@pytest.mark.parametrize(
    ("x", "verified", "primal"), [(0.5, 1, 0.0), (0.4, 0, 0.0), (0.7, 0, 0.2), (np.nan, 0, np.nan)]
)
def test_an_answer_is_held_to_its_program(x: float, verified: int, primal: float) -> None:
    """The closed form is; what is not the optimum, or breaks a bound, is a false claim."""
    solve = make_solve(None, None)
    solve.begin_run(1)
    solve.begin_step(0)
    solve.verify(program(), np.full(N, x))
    found = solve.rechecked()
    assert found.claimed[0] == 1
    assert (found.verified[0], bool(found.lied[0])) == (verified, not verified)
    assert found.primal[0] == pytest.approx(primal, nan_ok=True)
    assert solve.calls == solve.solve_ns == 0


def test_arrays_may_be_used_again() -> None:
    """What is handed over is what it was then."""
    solve, posed, x = make_solve(None, None), program(), np.full(N, 0.5)
    solve.begin_run(1)
    solve.begin_step(0)
    solve.verify(posed, x)
    posed.q[:] = 7.0
    x[:] = 7.0
    assert solve.rechecked().verified[0] == 1


def test_the_timing_pass_rechecks_nothing() -> None:
    """There a recheck would change the caches."""
    solve = make_solve(None, None, checks=False)
    solve.verify(program(), np.zeros(N))
    assert solve.rechecked().claimed[0] == -1


def test_rows_are_rechecked_each() -> None:
    """Of many control steps at once; a row without an answer is left out."""
    many = ManySolve(guesses=False)
    many.begin_step([make_solve(None, None) for _ in range(3)])
    assert many.rechecked is None
    rows = QuadraticProgram(np.eye(N), np.tile(-np.ones(N), (3, 1)), ub=np.full(N, 0.5))
    many.verify(rows, np.array([[0.5] * N, [0.1] * N, [np.nan] * N]))
    assert many.rechecked is not None
    assert many.rechecked.verified.tolist() == [1, 0, -1]


@dataclass(frozen=True)
class HandsOver:
    """The least-norm velocity, as the optimum of a program; or a lie about it."""

    lie: float = 1.0
    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        J, V = problem.primary.J, problem.primary.V
        v: Array = np.squeeze(np.linalg.pinv(J) @ V[..., None], -1)
        n = v.shape[-1]
        q = np.zeros(v.shape)
        solve.verify(QuadraticProgram(np.eye(n), q, A=J, b=V), self.lie * v)
        return v


@pytest.mark.parametrize("lie", [1.0, 1.5])
def test_a_run_says_whether_its_answers_were_right(lie: float) -> None:
    """Alone and in lockstep; the share of verified steps is that of a solver."""
    scenario, law = slow_line(), HandsOver(lie)
    alone = simulate(scenario, law, make_solve(None, None), Ideal(), "time", 0)
    trials = [LockstepTrial(scenario, law, make_solve(None, None), 0, True) for _ in range(2)]
    together = [each.run for each in simulate_together(trials, Ideal(), "time")]
    for run in (alone, *together):
        [row] = measure([Measured(run.trace, scenario, None, run.status)])
        assert row["claimed_share"] == 1.0
        assert (row["verified_share"] == 1.0) is (lie == 1.0)
        assert (row["not_verified_share"] == 0.0) is (lie == 1.0)


def test_the_report_says_who_did_not_hand_over() -> None:
    """A formulation without a verified step; the oracle is none."""
    rows = pd.DataFrame(
        {
            "formulation": ["a", "a", "b", "oracle"],
            "formulation_name": ["a", "a", "b", "oracle"],
            "steps": [5, 5, 5, 5],
            "verified_share": [np.nan, np.nan, 1.0, np.nan],
        }
    )
    [found] = _not_rechecked(rows)
    assert found.cases == ("`a`.",)
    assert _not_rechecked(rows[rows["formulation"] != "a"]) == []
