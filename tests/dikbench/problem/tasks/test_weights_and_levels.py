"""Weights of tasks, and several tasks at once: stacks and levels; the middle of the limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from makers.problems import kinematics_at, problem_of
from makers.tasks import (
    random_q,
    tip_of,
)

from dikbench.errors import DikbenchError
from dikbench.problem.tasks import (
    CentreOfMassTask,
    DampingTask,
    LinearizedTask,
    OrientationTask,
    PoseTask,
    PositionTask,
    PostureTask,
    Task,
)
from dikbench.problem.tasks.task import stacked
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot


def _weighted(kind: str, robot: Robot, weight: object) -> LinearizedTask:
    makers: dict[str, Callable[[], Task]] = {
        "posture": lambda: PostureTask(robot.q0 + 0.1, weight=weight),  # type: ignore[arg-type]
        "damping": lambda: DampingTask(weight=weight),  # type: ignore[arg-type]
        "centre": lambda: CentreOfMassTask(np.ones(3), weight=weight),  # type: ignore[arg-type]
        "pose": lambda: PoseTask(
            tip_of(robot, robot.q0),
            weight=weight,  # type: ignore[arg-type]
        ),
        "position": lambda: PositionTask(np.ones(3), weight=weight),  # type: ignore[arg-type]
        "orientation": lambda: OrientationTask(np.eye(3), weight=weight),  # type: ignore[arg-type]
    }
    return makers[kind]().linearize(kinematics_at(robot, robot.q0 + 0.2))


KINDS = {"posture": 7, "damping": 7, "centre": 3, "pose": 6, "position": 3, "orientation": 3}


@pytest.mark.parametrize("kind", KINDS)
def test_weights_are_a_number_or_one_per_row(kind: str) -> None:
    """J^T W J and J^T W V with W = diag(w), for a float, an integer and a vector."""
    robot, rows = load_robot("panda"), KINDS[kind]
    for weight in (0.25, 2, np.float64(0.5), np.linspace(0, 1, rows), [0.3] * rows):
        task = _weighted(kind, robot, weight)
        W = np.diag(np.broadcast_to(weight, rows))
        square, pull = task.normal_equations()
        assert square == pytest.approx(task.J.T @ W @ task.J, abs=1e-14)
        assert pull == pytest.approx(task.J.T @ W @ task.V, abs=1e-14)


@pytest.mark.parametrize("weight", [-1.0, float("nan"), float("inf"), np.ones(5), "heavy", None])
@pytest.mark.parametrize("kind", KINDS)
def test_wrong_weights_are_errors_of_one_line(kind: str, weight: object) -> None:
    """Which task, what was given, and how many numbers would be valid."""
    with pytest.raises(DikbenchError, match=f"task: weight: expected a number or {KINDS[kind]}"):
        _weighted(kind, load_robot("panda"), weight)


def _task(rows: int, **kwargs: object) -> LinearizedTask:
    random = np.random.default_rng(rows)
    J, V, error = random.normal(size=(rows, 7)), random.normal(size=rows), random.normal(size=rows)
    return LinearizedTask(J, V, error, **kwargs)  # type: ignore[arg-type]


def test_stacked_tasks_are_rows_below_each_other() -> None:
    """J, V and error in the order of the tasks, weights one per row, the first's priority."""
    a = _task(2, weight=3.0, priority=2)
    b = _task(3, weight=np.array([1.0, 2.0, 4.0]), priority=2)
    both = stacked([a, b])
    assert np.array_equal(both.J, np.concatenate([a.J, b.J]))
    assert np.array_equal(both.V, np.concatenate([a.V, b.V]))
    assert np.array_equal(both.error, np.concatenate([a.error, b.error]))
    assert np.array_equal(both.weight, [3, 3, 1, 2, 4])
    assert both.priority == 2
    assert both.log_derivative is None


def test_a_single_task_is_its_own_stack() -> None:
    """Nothing is copied on the way that most laws take."""
    only = _task(2)
    assert stacked([only]) is only


def test_the_log_derivative_of_a_stack_is_block_diagonal() -> None:
    """A pose's block beside the identity of tasks that have none."""
    robot, random = load_robot("panda"), np.random.default_rng(8)
    at = kinematics_at(robot, robot.q0)
    pose = PoseTask(target=tip_of(robot, random_q(robot, random, 0.5))).linearize(at)
    posture = PostureTask(target=random_q(robot, random), priority=1).linearize(at)
    Jl = stacked([posture, pose]).log_derivative
    assert Jl is not None
    assert Jl.shape == (13, 13)
    assert np.array_equal(Jl[:7, :7], np.eye(7))
    assert pose.log_derivative is not None
    assert np.array_equal(Jl[7:, 7:], pose.log_derivative)
    assert np.all(Jl[:7, 7:] == 0)
    assert np.all(Jl[7:, :7] == 0)


def test_a_problem_sorts_its_tasks_into_levels() -> None:
    """One stacked task per priority, the most important first, and that one is the primary."""
    robot = load_robot("panda")
    a, b, c = _task(2, priority=1), _task(3, priority=1), _task(4, priority=5)
    problem = problem_of(a, b, c, robot=robot)
    assert [len(level.V) for level in problem.levels] == [5, 4]
    assert np.array_equal(problem.primary.V, np.concatenate([a.V, b.V]))
    assert problem.levels[1] is c
    alone = problem_of(a, c, robot=robot)
    assert alone.primary is a
    shuffled = problem_of(a, c, b, robot=robot)
    assert [level.priority for level in shuffled.levels] == [1, 5]


def test_the_middle_is_half_way_between_the_limits() -> None:
    """As far from the lower as from the upper limit, NaN for a joint that lacks one."""
    robot = load_robot("planar3r").with_limits(position=([-1, -2, 0], [3, 1, np.inf]))
    np.testing.assert_array_equal(robot.limits.middle, [1.0, -0.5, np.nan])
    panda = load_robot("panda")
    assert panda.limits.middle is not None
    seen = panda.limits.at(panda.limits.middle)
    assert seen.to_lower == pytest.approx(seen.to_upper)
    assert panda.with_limits(position=None).limits.middle is None
