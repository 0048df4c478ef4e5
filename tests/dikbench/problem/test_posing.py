"""Posing a problem: what it holds, and that the order in which tasks are listed does not matter."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import problem_of

from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem import (
    DikProblem,
    Kinematics,
    LinearizedTask,
    PoseTask,
    PostureTask,
    TorqueConstraint,
    linearize_all,
    pose_problem,
    program_of,
)
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve

HUMANOID = make_scenario("humanoid")
"""Hand and two feet (priority 1), the centre of mass (2) and the posture (3)."""

ORDERS = [*itertools.permutations(HUMANOID.tasks)][1:]
FORMULATIONS = ("pinv", "dls", "nullspace", "hqp", "qp", "lp-alpha", "sns", "weighted-least-norm")


def _start(scenario: Scenario) -> DikProblem:
    """The first problem of a scenario, whose hand is to go up at 0.1 m/s."""
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    at = kinematics.placement(scenario.robot.frame_id).copy()
    up = pin.Motion(at.rotation.T @ [0.0, 0.0, 0.1], np.zeros(3))
    tracking = scenario.tracking.linearize(kinematics, at, up)
    return pose_problem(kinematics, scenario.v0, scenario.dt, tracking, scenario.tasks)


def _solve(formulation: str) -> CheckedSolve:
    program = program_of(make_formulation(formulation))
    return make_solve(parse_solver(DEFAULT_SOLVER[program]) if program else None, program)


def _velocity(formulation: str, problem: DikProblem) -> Array:
    return make_formulation(formulation).velocity(problem, _solve(formulation))


def test_the_primary_task_is_the_first_level_in_any_order() -> None:
    """The hand and both feet, whatever stands between them in the list."""
    listed = _start(HUMANOID)
    for order in ORDERS:
        posed = _start(replace(HUMANOID, tasks=order))
        assert [len(level.V) for level in posed.levels] == [18, 3, 36]
        assert posed.primary is posed.levels[0]
        assert [task.priority for task in posed.tasks] == [1, 1, 1, 2, 3]
        # The tracking stays the first of its level; the feet keep the order of the list.
        assert np.array_equal(posed.primary.V[:6], listed.primary.V[:6])
        for level, expected in zip(posed.levels, listed.levels, strict=True):
            for found, wanted in zip(
                level.normal_equations(), expected.normal_equations(), strict=True
            ):
                assert found == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_formulation_answers_alike_in_any_order(formulation: str) -> None:
    """To the solver's tolerance: equal priorities may stand in another order in a level."""
    expected = _velocity(formulation, _start(HUMANOID))
    assert np.abs(expected).max() > 0.01
    for order in (HUMANOID.tasks[::-1], ORDERS[7], ORDERS[16]):
        found = _velocity(formulation, _start(replace(HUMANOID, tasks=order)))
        assert found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("formulation", ["pinv", "hqp"])
def test_a_trial_is_the_same_in_any_order(formulation: str) -> None:
    """The same motion, and the record is of the tracking alone."""
    short = replace(HUMANOID, duration=0.05)
    runs = [
        simulate(
            replace(short, tasks=order), make_formulation(formulation), _solve(formulation), Ideal()
        )
        for order in (short.tasks, short.tasks[::-1])
    ]
    assert runs[0].trace.q[-1] == pytest.approx(runs[1].trace.q[-1], abs=1e-9)
    assert np.abs(runs[0].trace.q[-1] - short.q0).max() > 1e-4
    for run in runs:
        assert run.trace.wanted.shape == (5, 6)
        assert run.jacobians.shape == (5, 6, 36)
        assert np.array_equal(run.trace.wanted[0], runs[0].trace.wanted[0])
        assert np.array_equal(run.jacobians[0], runs[0].jacobians[0])


@settings(deadline=None)
@given(priorities=st.lists(st.integers(1, 4), min_size=1, max_size=6))
def test_a_problem_made_by_hand_is_sorted(priorities: list[int]) -> None:
    """By priority, stably, and stacked in that order; the list that was given stays as it is."""
    robot = load_robot("planar3r")
    given_tasks = [
        LinearizedTask(np.full((1, 3), float(k)), np.array([float(k)]), np.zeros(1), 1.0, p)
        for k, p in enumerate(priorities)
    ]
    tasks = [*given_tasks]
    problem = problem_of(*tasks, robot=robot)
    expected = [k for p in range(1, 5) for k, q in enumerate(priorities) if p == q]
    assert [int(task.V[0]) for task in problem.tasks] == expected
    assert np.concatenate([level.V for level in problem.levels]).tolist() == expected
    assert [level.priority for level in problem.levels] == sorted(set(priorities))
    assert problem.primary is problem.levels[0]
    assert all(task is before for task, before in zip(tasks, given_tasks, strict=True))


def test_a_posed_problem_is_of_its_configuration() -> None:
    """State, limits, tasks and rows G v <= h are those of the kinematics' configuration."""
    robot = load_robot("panda").with_limits(effort=10.0)
    kinematics, q = Kinematics(robot), robot.q0 + 0.1
    kinematics.update(q)
    v_prev = np.full(7, 0.2)
    posture, constraint = PostureTask(robot.q0, gain=2.0), TorqueConstraint()
    target = kinematics.placement(robot.frame_id).copy()
    tracking = PoseTask(target=target).linearize(kinematics)
    problem = pose_problem(kinematics, v_prev, 0.02, tracking, [posture], [constraint])
    assert problem.robot is robot
    assert problem.q is q
    assert problem.v_prev is v_prev
    assert (problem.dt, problem.relaxed) == (0.02, 0)
    assert robot.limits.position is not None
    assert problem.limits.to_upper == pytest.approx(robot.limits.position.upper - q)
    assert problem.primary is problem.tasks[0] is tracking
    assert problem.tasks[1].V == pytest.approx(np.full(7, -0.2))
    G, h = linearize_all([constraint], kinematics, v_prev, 0.02)
    np.testing.assert_array_equal(problem.G, G)
    np.testing.assert_array_equal(problem.h, h)
    assert problem.G is not None
    alone = pose_problem(kinematics, None, 0.02, tracking)
    assert (alone.v_prev, alone.G, alone.h, len(alone.tasks)) == (None, None, None, 1)
