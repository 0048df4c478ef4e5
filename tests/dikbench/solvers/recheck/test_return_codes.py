"""Return codes against the recheck: the known lie at an exact singularity, and their table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest

from dikbench.arrays import Array
from dikbench.plugins.building import make_scenario
from dikbench.problem import DikProblem, Solve
from dikbench.programs.quadratic_program import ProgramKind, QuadraticProgram
from dikbench.report.tables.return_codes import return_codes
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.run.trial_row import run_trial
from dikbench.scenario.plant import Saturating
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve
from dikbench.study.trial import Trial

pytestmark = pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\.")

WRIST = np.array([0.3, -1.2, 1.4, -1.0, 0.0, 0.2])
"""A UR5 with its wrist exactly singular."""


def impossible() -> QuadraticProgram:
    """A twist that the arm cannot make there, as an equality: inconsistent, of deficient rank."""
    robot = load_robot("ur5")
    kinematics = Kinematics(robot)
    kinematics.update(WRIST)
    J = kinematics.jacobian(robot.frame_id)
    U, singular, _ = np.linalg.svd(J)
    assert singular[-1] < 1e-15
    limit = robot.limits.velocity
    assert limit is not None
    V = 0.1 * U[:, -1] + 0.1 * U[:, 0]
    return QuadraticProgram(
        1e-6 * np.eye(6), np.zeros(6), A=J, b=V, lb=limit.lower.copy(), ub=limit.upper.copy()
    )


def test_the_false_success_at_the_exact_wrist_is_caught() -> None:
    """One solver calls it solved with the equality off by most of a metre per second."""
    solve = make_solve(parse_solver("daqp"), "qp")
    x = solve(impossible())  # handed out: it was claimed
    verdicts = solve.rechecked()
    off = float(np.abs(impossible().A @ x - impossible().b).max())  # type: ignore[operator]
    assert off > 0.1
    assert (verdicts.claimed[0], verdicts.verified[0]) == (1, 0)
    assert verdicts.primal[0] == pytest.approx(off, rel=1e-6)


@pytest.mark.parametrize("selector", ["piqp", "osqp", "clarabel", "highs"])
def test_others_say_that_there_is_no_answer(selector: str) -> None:
    """An honest failure: neither claimed nor verified, so the return code is right."""
    solve = make_solve(parse_solver(selector), "qp")
    with pytest.raises(Exception, match="no feasible point"):
        solve(impossible())
    verdicts = solve.rechecked()
    assert (verdicts.claimed[0], verdicts.verified[0]) == (0, 0)


@dataclass(frozen=True)
class HardEquality:
    """The primary task as an equality, whatever the robot can do."""

    program: ClassVar[ProgramKind] = "qp"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task, n = problem.primary, problem.robot.nv
        box = problem.box()
        return solve(
            QuadraticProgram(
                1e-6 * np.eye(n), np.zeros(n), A=task.J, b=task.V, lb=box.lower, ub=box.upper
            )
        )


def test_claims_and_verdicts_of_a_run_reach_the_trace() -> None:
    """Near a singularity the equality is infeasible at most steps, and no lie is an `ok`."""
    scenario = make_scenario("near-miss[robot=ur5,miss=0.005]")
    solve = make_solve(parse_solver("daqp"), "qp")
    trace = simulate(scenario, HardEquality(), solve, Saturating()).trace
    lied = (trace.claimed == 1) & (trace.verified == 0)
    assert trace.share(Status.NOT_VERIFIED) == np.mean(lied)
    assert (trace.claimed == 0).any()
    assert ((trace.claimed == 1) & (trace.verified == 1)).any()
    unanswered = trace.share(Status.INFEASIBLE) + trace.share(Status.SOLVER_FAILED)
    assert unanswered == np.mean(trace.claimed == 0)


def test_a_row_says_how_often_the_return_code_was_right() -> None:
    """OSQP at its own settings claims everything; a third of it is wrong by our residuals."""
    rows = [
        run_trial(Trial.of("qp", "near-miss[miss=0.02]", solver, "ideal", "time", 0))
        for solver in ("osqp", "daqp", "osqp[preset=high]")
    ]
    loose, exact, tight = rows
    assert loose["claimed_share"] == exact["claimed_share"] == tight["claimed_share"] == 1.0
    assert loose["verified_share"] < 0.9
    assert loose["disagreed_share"] == pytest.approx(1 - loose["verified_share"])
    assert exact["disagreed_share"] == 0.0
    assert tight["disagreed_share"] == 0.0
    without = run_trial(Trial.of("dls", "reach", "none", "ideal", "time", 0))
    assert np.isnan(without["claimed_share"])


def test_the_table_weighs_trials_by_their_steps() -> None:
    """Laws without a solver are not in it; an honest failure counts as right."""
    trials = pd.DataFrame(
        {
            "solver": ["a", "a", "b", "none"],
            "steps": [100, 300, 10, 50],
            "claimed_share": [1.0, 1.0, 0.0, np.nan],
            "verified_share": [1.0, 0.0, 0.0, np.nan],
            "disagreed_share": [0.0, 1.0, 0.0, np.nan],
        }
    )
    table = return_codes(trials).set_index("solver")
    assert list(table.index) == ["a", "b"]
    assert table.loc["a", "return code right"] == pytest.approx(0.25)
    assert table.loc["a", "verified"] == pytest.approx(0.25)
    assert table.loc["b", "return code right"] == 1.0
    assert table.loc["a", "steps"] == 400
