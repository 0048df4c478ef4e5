"""Variants of saturation in the null space: with one inverse per task, and with a scale margin."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
import pytest
from makers.problems import equations, planar_robot, problem_of, velocity_of

from dikbench import Robot
from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.problem import DikProblem

Level = tuple[Array, Array]


@functools.cache
def arm(n: int) -> Robot:
    """An arm of n joints without position limits."""
    return planar_robot(*(0.2,) * n, velocity=1.0).with_limits(position=None)


def limited(upper: Array, *levels: Level) -> DikProblem:
    """A control step with velocity limits +- `upper` and tasks J v = V, one per priority."""
    robot = arm(len(upper)).with_limits(velocity=(-upper, upper))
    return problem_of(*equations(*levels), robot=robot)


def answer(law: str, problem: DikProblem) -> Array:
    """What a law answers."""
    return velocity_of(make_formulation(law), problem)


def share(level: Level, v: Array) -> float:
    """How much of a task is done; nothing beside it."""
    J, V = level
    s = float(J @ v @ V / (V @ V))
    assert J @ v == pytest.approx(s * V, abs=1e-9)
    return s


def states(count: int, m: int, seed: int = 0) -> Iterator[tuple[Array, Level]]:
    """Random limits of seven joints and tasks of m rows, many of which do not fit."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        size = random.uniform(0.1, 2)
        yield random.uniform(0.2, 2, 7), (random.normal(size=(m, 7)), size * random.normal(size=m))


@pytest.mark.parametrize("m", [1, 3, 6])
def test_the_fast_one_is_saturation_where_one_task_has_full_rank(m: int) -> None:
    """To rounding, joints held or not, scaled or not."""
    held = scaled = 0
    for upper, level in states(150, m):
        problem = limited(upper, level)
        v = answer("sns-fast", problem)
        assert v == pytest.approx(answer("sns", problem), abs=1e-9)
        least = np.linalg.pinv(level[0]) @ level[1]
        held += bool((np.abs(least) > upper).any())
        scaled += share(level, v) < 1 - 1e-9
    assert held > 5
    assert scaled > 0


def test_what_the_fast_one_holds_stays_held_below() -> None:
    """A joint at its bound for the first task does not come off it for the second; in `sns` it may.

    Three joints, J_1 = (1 1 0), V_1 = 3, v <= (1, 3, 3): the first is held at 1, the second does 2.
    The second task would have v_1 lower.
    """
    upper = np.array([1.0, 3.0, 3.0])
    first = (np.array([[1.0, 1.0, 0.0]]), np.array([3.0]))
    second = (np.array([[1.0, 0.0, 1.0]]), np.array([0.5]))
    fast, free = (answer(law, limited(upper, first, second)) for law in ("sns-fast", "sns"))
    assert fast == pytest.approx([1.0, 2.0, -0.5])
    assert first[0] @ free == pytest.approx(first[1])
    assert free[0] < 1 - 1e-3
    assert share(second, free) == pytest.approx(1.0)


def test_the_fast_one_does_the_first_task_as_if_it_were_alone() -> None:
    """Whatever is below it; the second keeps its direction or is left out."""
    done = 0
    for (upper, first), (_, second) in zip(states(100, 2), states(100, 2, seed=1), strict=True):
        alone = answer("sns-fast", limited(upper, first))
        v = answer("sns-fast", limited(upper, first, second))
        assert first[0] @ v == pytest.approx(first[0] @ alone, abs=1e-9)
        assert (np.abs(v) <= upper).all()
        if not np.array_equal(v, alone):
            assert -1e-9 <= share(second, v) <= 1 + 1e-9
            done += 1
    assert done > 50


def test_the_fast_one_scales_a_task_that_has_lost_a_rank() -> None:
    """The least motion by the largest factor that fits; `sns` lets other joints make up for it."""
    upper = np.array([1.0, 3.0, 3.0])
    J = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0]])
    problem = limited(upper, (J, np.array([3.0, 6.0])))
    assert answer("sns-fast", problem) == pytest.approx([1.0, 1.0, 0.0])
    assert answer("sns", problem) == pytest.approx([1.0, 2.0, 0.0])


@pytest.mark.parametrize(
    ("wanted", "v"),
    [
        (1.0, [0.5, 0.5]),  # 2 would fit without holding a joint
        (1.9, [0.9, 0.9]),  # 2 as well: 0.9 of it
        (3.2, [1.0, 2.2]),  # 4 would fit with the first joint held
        (3.8, [1.0, 2.6]),
        (8.0, [1.0, 2.6]),
        (-1.9, [-0.9, -0.9]),
        (0.0, [0.0, 0.0]),
    ],
)
def test_the_margin_by_hand(wanted: float, v: list[float]) -> None:
    """J = (1, 1), |v| <= (1, 3), margin 0.9."""
    problem = limited(np.array([1.0, 3.0]), (np.ones((1, 2)), np.array([wanted])))
    assert answer("sns-margin", problem) == pytest.approx(v, abs=1e-12)


@pytest.mark.parametrize("margin", [0.5, 0.9])
@pytest.mark.parametrize("m", [3, 6])
def test_the_margin_is_optimal_saturation_of_a_scaled_task(m: int, margin: float) -> None:
    """Its answer is that of `sns-optimal` to what it does, and no less than the margin of it."""
    slowed = full = 0
    for upper, level in states(150, m):
        v = answer(f"sns-margin[scale_margin={margin}]", limited(upper, level))
        most = share(level, answer("sns-optimal", limited(upper, level)))
        s = share(level, v)
        assert margin * most - 1e-9 <= s <= most + 1e-9
        if most < 1 - 1e-9:
            assert s == pytest.approx(margin * most)
        again = answer("sns-optimal", limited(upper, (level[0], s * level[1])))
        assert v == pytest.approx(again, abs=1e-7)
        slowed, full = slowed + (s < most - 1e-9), full + (s > 1 - 1e-9)
    assert slowed > 20
    assert full > 5


def test_without_a_margin_it_is_optimal_saturation() -> None:
    """Two tasks as well."""
    for (upper, first), (_, second) in zip(states(60, 2), states(60, 2, seed=1), strict=True):
        problem = limited(upper, first, second)
        v = answer("sns-margin[scale_margin=1]", problem)
        assert v == pytest.approx(answer("sns-optimal", problem), abs=0)


@pytest.mark.parametrize("margin", ["0", "1.1", "-0.5", "nan"])
def test_a_margin_outside_its_range_is_refused(margin: str) -> None:
    """In one line that names it."""
    with pytest.raises(DikbenchError, match="scale_margin"):
        make_formulation(f"sns-margin[scale_margin={margin}]")
