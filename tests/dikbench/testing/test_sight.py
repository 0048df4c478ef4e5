"""What a formulation sees of a problem, and what it refuses, is declared; the check holds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from makers.scenarios import planar_scenario

from dikbench import load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.problem import (
    DikProblem,
    OrientationTask,
    PositionTask,
    PostureTask,
    ProblemPart,
    Solve,
    TorqueConstraint,
)
from dikbench.problem.problem import refusal_of, sees_constraints, sees_lower_tasks, sight_of
from dikbench.run.trial_row import run_trial
from dikbench.study.trial import Trial
from dikbench.testing import check_declaration, check_sight, states
from dikbench.testing.verdicts import verdicts_on_formulation


@dataclass(frozen=True)
class _Still:
    """Stands still, and says that it sees a posture."""

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"postures"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        return np.zeros(problem.robot.nv)


@dataclass(frozen=True)
class _ByTheRows:
    """Moves as the rows push, and says nothing of it."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        n = problem.robot.nv
        return np.zeros(n) if problem.G is None else -problem.G[0]


@dataclass(frozen=True)
class _ByAnyTask:
    """Looks at all tasks, and declares postures alone."""

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"postures"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        v: Array = np.sum([task.V.dot(task.J) for task in problem.tasks], axis=0)
        return v


@dataclass(frozen=True)
class _ByWeights:
    """Weighs, and says nothing of it."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        v: Array = problem.primary.J.T @ (problem.primary.weight * problem.primary.V)
        return v


@dataclass(frozen=True)
class _Misspelt:
    sees: ClassVar[frozenset[str]] = frozenset({"obstacles"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        return np.zeros(problem.robot.nv)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (_Still, "`sees` declares a posture task below the first priority"),
        (_ByTheRows, "rows G v <= h changed the answer"),
        (_ByAnyTask, ": a task below the first priority changed the answer"),
        (_ByWeights, ": a weight of each row changed the answer"),
    ],
)
def test_a_declaration_that_is_not_true_is_found(make: Callable[[], _Still], said: str) -> None:
    """Of what is not seen and of what is."""
    with pytest.raises(AssertionError, match=said):
        check_sight(make())


def test_a_part_that_is_none_is_found() -> None:
    """The valid ones are named."""
    with pytest.raises(AssertionError, match=r"obstacles.*valid: inequalities, postures"):
        check_declaration(_Misspelt())


def test_who_keeps_rows_sees_them() -> None:
    """A promise needs no second declaration."""
    assert "inequalities" in sight_of(make_formulation("qp"))
    assert sight_of(make_formulation("dls")) == frozenset()


def test_what_is_seen_of_a_problem() -> None:
    """Nothing is said of rows and tasks that are not there; a posture is one of the lower tasks."""
    found = set()
    for state in states():
        problem = state.problem
        rows = sees_constraints(make_formulation("pinv"), problem)
        assert rows is (None if problem.G is None else False)
        for name, sees in (("nullspace", True), ("drake-system", True), ("dls", False)):
            seen = sees_lower_tasks(make_formulation(name), problem)
            assert seen is (None if len(problem.tasks) == 1 else sees)
            found.add(seen)
    assert found == {None, True, False}


def test_a_formulation_that_cannot_is_refused_at_the_prompt() -> None:
    """Two tasks of first priority have no components, and a task below is not looked at."""
    robot = load_robot("panda")
    elbow = PositionTask(target=np.zeros(3), frame="panda_link4", priority=1)
    posture = PostureTask(robot.q0)
    name, twist = "lp-alpha-components", [0.1, 0, 0, 0, 0, 0]
    with pytest.raises(DikbenchError, match="LpAlphaComponents: components are those of a pose"):
        solve_dik(robot, robot.q0, formulation=name, twist=twist, tasks=[elbow])
    with pytest.raises(DikbenchError, match="LpAlphaComponents: does not look at tasks below"):
        solve_dik(robot, robot.q0, formulation=name, twist=twist, tasks=[posture])
    assert refusal_of(make_formulation("qp"), next(states()).problem) == ""


def test_a_trial_that_is_refused_is_skipped_with_the_reason() -> None:
    """Before anything is simulated."""
    row = run_trial(Trial.of("lp-alpha-components", "humanoid", "daqp"))
    assert (row["status"], row["steps"]) == ("skipped", 0)
    assert "not of several tasks" in row["message"]


@dataclass(frozen=True)
class _ForSixRows:
    """Refuses arms in the plane, of which it can make nothing; with `all`, every arm."""

    all: bool = False

    def refuses(self, problem: DikProblem) -> str:
        return "six rows" * (self.all or len(problem.primary.V) < 6)

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        v: Array = np.zeros(problem.robot.nv) + 0.0 * problem.primary.V[5]
        return v


def test_the_contract_does_not_ask_what_is_refused() -> None:
    """A formulation is held to what it answers; one that refuses everything cannot be checked."""
    assert {v.outcome for v in verdicts_on_formulation(_ForSixRows())} == {"kept", "not promised"}
    verdicts = {v.check: v for v in verdicts_on_formulation(_ForSixRows(all=True))}
    assert verdicts["raises only cannot answer"].outcome != "kept"


def test_constraints_that_are_not_looked_at_are_refused() -> None:
    """At the prompt by an error, in a study by a skipped cell; who sees them is asked."""
    robot = load_robot("ur5").with_limits(effort=load_robot("ur5").available_effort)
    arguments: dict[str, Any] = {"twist": [0.1, 0, 0, 0, 0, 0], "constraints": [TorqueConstraint()]}
    with pytest.raises(DikbenchError, match="DampedLeastSquares: does not look at constraints"):
        solve_dik(robot, robot.q0, formulation="dls", **arguments)
    assert solve_dik(robot, robot.q0, formulation="qp", **arguments).status.value == "ok"
    row = run_trial(Trial.of("dls", "torque-limited[robot=ur5]", "none"))
    assert (row["status"], row["steps"], row["sees_constraints"]) == ("skipped", 0, False)
    assert "does not look at constraints" in row["message"]
    assert row["outcome"] == row["decided_before"] == "does-not-see"


def test_no_formulation_is_blamed_for_a_target_that_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A scenario whose task cannot be posed is skipped with the reason."""
    mirrored = OrientationTask(target=-np.eye(3), priority=2)
    wrong = replace(planar_scenario(), tasks=(mirrored,))
    monkeypatch.setattr("dikbench.run.trial_row.scenario_of", lambda selector, seed: wrong)
    row = run_trial(Trial.of("dls", "near-miss", "none"))
    assert (row["status"], row["steps"]) == ("skipped", 0)
    assert "is not a rotation" in row["message"]


@pytest.mark.parametrize(
    ("formulation", "solver", "scenario", "seen"),
    [
        ("qp", "daqp", "obstacle[robot=ur5]", (True, None, None)),
        ("dls", "none", "near-miss", (None, None, None)),
        ("dls", "none", "reach[robot=panda]", (None, False, None)),
        ("nullspace", "none", "reach[robot=panda]", (None, True, None)),
        ("oracle", "none", "torque-limited[robot=ur5]", (None, None, None)),
        ("dls", "none", "log-derivative-drift", (None, None, False)),
        ("lm", "none", "log-derivative-drift", (None, None, True)),
    ],
)
def test_a_row_says_what_was_seen(
    formulation: str, solver: str, scenario: str, seen: tuple[bool | None, ...]
) -> None:
    """Empty where there was nothing to see."""
    row = run_trial(Trial.of(formulation, scenario, solver))
    assert row["status"] == "ok", row["message"]
    assert (row["sees_constraints"], row["sees_lower_tasks"], row["sees_weights"]) == seen
