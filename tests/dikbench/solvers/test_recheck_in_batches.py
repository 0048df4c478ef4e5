"""What is found of answers does not depend on when they are rechecked."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from makers.programs import (
    LIBRARIES_WARN,
    ScriptedSolver,
    ask,
    one_bound,
    said,
)

from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers import checked_solve
from dikbench.solvers.checked_solve import CheckedSolve
from dikbench.solvers.interfaces.cold import ColdSolver
from dikbench.solvers.recheck.optimum import JUDGE_SOLVER, PROVEN_DISTANCE
from dikbench.solvers.recheck.rechecked import RecheckedSteps

pytestmark = LIBRARIES_WARN


def _program(random: np.random.Generator, n: int, kind: int) -> QuadraticProgram:
    """A program with a feasible point (zero) of one of a few structures."""
    root = random.normal(size=(n, n))
    P = root @ root.T + 0.1 * np.eye(n) if kind else np.zeros((n, n))
    G, h = (random.normal(size=(2, n)), np.ones(2)) if kind == 2 else (None, None)
    A, b = (random.normal(size=(1, n)), np.zeros(1)) if kind == 3 else (None, None)
    bound = random.uniform(0.1, 1.0, n)
    return QuadraticProgram(P, random.normal(size=n), G, h, A, b, -bound, bound)


def _run(seed: int, steps: int = 25) -> RecheckedSteps:
    """What is found on a run of up to four answers per step: right, wrong, none, unexplained."""
    random = np.random.default_rng(seed)
    exact = ColdSolver(JUDGE_SOLVER)
    script = ScriptedSolver()
    solve = CheckedSolve(script, tolerance=1e-6)
    solve.begin_run(steps)
    for step in range(steps):
        solve.begin_step(step)
        for _ in range(random.integers(0, 5)):
            program = _program(random, int(random.integers(2, 5)), int(random.integers(0, 4)))
            answer = exact(program)
            assert answer.x is not None
            answer.claimed = bool(random.random() < 0.9)
            fate = random.random()
            if fate < 0.3:
                answer.x = answer.x + 10.0 ** random.uniform(-9, 0) * random.normal(
                    size=len(answer.x)
                )
            elif fate < 0.35:
                answer.x = None
            elif fate < 0.4:
                answer.x = np.full(len(program.q), np.nan)
            elif fate < 0.5:
                answer.z_box = None
            script.answers.append(answer)
            ask(solve, program)
    return solve.rechecked()


@pytest.mark.parametrize("seed", range(4))
def test_what_is_found_does_not_depend_on_when_it_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Step by step, in small batches, or all at the end; but for the part of proven distances."""
    found = {}
    for batch in (1, 3, 512):
        monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", batch)
        found[batch] = _run(seed)
    last = found[512]
    assert {-1, 0, 1} == set(last.claimed.tolist()) == set(last.verified.tolist())
    assert not np.array_equal(last.claimed, last.verified)
    for batch in (1, 3):
        assert found[batch].claimed.tolist() == last.claimed.tolist()
        assert found[batch].verified.tolist() == last.verified.tolist()
        for part in ("primal", "dual", "gap"):
            one, other = getattr(found[batch], part), getattr(last, part)
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-13, equal_nan=True)
        # A bound that is proof enough stands for the distance, and is that of its batch.
        np.testing.assert_allclose(
            found[batch].distance, last.distance, rtol=1e-9, atol=PROVEN_DISTANCE, equal_nan=True
        )


def test_the_recheck_keeps_to_its_batches(monkeypatch: pytest.MonkeyPatch) -> None:
    """No more than so many answers wait, and whole steps are rechecked."""
    waiting: list[int] = []

    def note(verdicts: RecheckedSteps, solved: list[Any], tolerance: float) -> None:
        waiting.append(len(solved))

    monkeypatch.setattr(RecheckedSteps, "recheck", note)
    monkeypatch.setattr(checked_solve, "ANSWERS_PER_RECHECK", 3)
    solve = CheckedSolve(ScriptedSolver(*(said(1.0, 1.0) for _ in range(10))))
    solve.begin_run(5)
    for step in range(5):
        solve.begin_step(step)
        solve(one_bound())
        solve(one_bound())
    solve.rechecked()
    assert waiting == [4, 4, 2]
