"""The path clock: the pace of exact and of slow laws, on a line, at a turn, through a dwell."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.scenarios import run_on_planar

from dikbench.arrays import Array
from dikbench.metrics import evaluate, motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.problem.tasks import PositionTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Reference, Scenario
from dikbench.scenario.certificate import Certificate
from dikbench.simulation.clock import PathClock

BASE = load_robot("base")
SPEED = 0.25
LENGTH = 0.5


def line(tau: float) -> float:
    """0.5 m in 2 s."""
    return SPEED * tau


def there_and_back(tau: float) -> float:
    """0.5 m and back, in 4 s."""
    return LENGTH - abs(LENGTH - SPEED * tau)


def with_dwell(tau: float) -> float:
    """0.5 m, a second's rest, and 0.5 m again, in 5 s."""
    return SPEED * (min(tau, 2.0) + max(tau - 3.0, 0.0))


WAYS = {line: 2.0, there_and_back: 4.0, with_dwell: 5.0}


def scenario(way: object, dt: float = 0.005, cap: float = 25.0) -> Scenario:
    """A point that goes along x."""
    assert callable(way)
    return Scenario(
        robot=BASE,
        q0=BASE.q0,
        v0=np.zeros(3),
        reference=Reference(
            WAYS[way],
            lambda tau: pin.SE3(np.eye(3), np.array([way(tau), 0.0, 0.0])),
            lambda tau: np.zeros(6),
        ),
        tracking=PositionTask(),
        dt=dt,
        duration=WAYS[way],
        certificate=Certificate(()),
        longest_path_run=cap,
    )


def at(x: float, y: float = 0.0) -> Array:
    """The configuration of the base at a point."""
    return np.array([x, y, 1.0, 0.0])


def ratio(case: Scenario, share: float, ahead: float = 0.0) -> float:
    """The time of a law that goes to where the target is next, over the nominal duration.

    Its speed is held to a share of the nominal one. `ahead` [m] is added to where it is, once and
    for all.
    """
    clock, x, steps = PathClock(case), 0.0, 0
    most = share * SPEED * case.dt * (1 + 1e-12)
    way = case.reference.placement
    for _ in clock:
        goal = way(min(clock.tau + case.dt, case.reference.duration)).translation[0]
        x += min(max(goal - x, -most), most)
        clock.advance(at(x + ahead))
        steps += 1
    return steps * case.dt / case.reference.duration


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("dt", [0.002, 0.005, 0.01])
def test_an_exact_law_moves_at_the_nominal_pace(way: object, dt: float) -> None:
    """On a line, there and back, and through a dwell: 1.000."""
    assert ratio(scenario(way, dt), 1.0) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("ahead", [1e-12, 1e-6, 1e-3, -1e-12, -1e-6, -1e-3])
def test_a_hair_ahead_or_behind_does_not_stop_it(ahead: float) -> None:
    """At the turning point, where a tracking law is sent back."""
    assert ratio(scenario(there_and_back), 1.0, ahead) == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize(("share", "expected"), [(0.5, 1.985), (0.2, 4.96), (0.05, 19.8)])
def test_a_law_at_a_share_of_the_speed_takes_as_much_longer(share: float, expected: float) -> None:
    """1 / share, less what the window of two periods forgives at the turn."""
    assert ratio(scenario(there_and_back), share) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("cap", [1.0, 2.0, 5.0])
def test_a_robot_that_stands_still_is_given_up(cap: float) -> None:
    """After the scenario's own number of nominal durations, a control period on its way."""
    case = scenario(line, cap=cap)
    clock, steps = PathClock(case), 0
    for _ in clock:
        clock.advance(at(0.0))
        steps += 1
    assert steps == clock.most_steps == round(cap * 400)
    assert clock.tau == pytest.approx(case.dt)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), way=st.sampled_from(list(WAYS)))
def test_the_clock_never_goes_back_nor_faster_than_time(seed: int, way: object) -> None:
    """Wherever the robot is thrown."""
    case = scenario(way, 0.01)
    clock, random = PathClock(case), np.random.default_rng(seed)
    for _ in range(100):
        before = clock.tau
        clock.advance(at(*random.uniform(-1, 1, 2)))
        assert before <= clock.tau <= min(before + case.dt + 1e-12, case.reference.duration)


def test_a_law_with_a_gain_below_1_does_not_creep_into_the_ends() -> None:
    """Of the minimum-jerk motions of `pick-and-place`: within 1.3 of the nominal duration."""
    scenario = make_scenario("pick-and-place")
    run = run_on_planar(make_formulation("dls[damping=0.05]"), scenario, mode="path")
    assert evaluate(motion_of(run.trace, scenario))["slow_down"] < 1.3
