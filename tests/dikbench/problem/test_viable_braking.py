"""Braking: the viable box is never empty along its own motions, the sqrt box is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import limits_at_distances

from dikbench.arrays import Array
from dikbench.problem.velocity_box import Braking, velocity_box
from dikbench.robots.braking import sqrt_brake, viable_brake

periods = st.floats(5e-4, 0.05)
accelerations = st.floats(0.5, 50.0)
speeds = st.floats(0.1, 10.0)
distances = st.floats(1e-6, 3.0)


def _stopping_distance(speed: float, deceleration: float, dt: float) -> float:
    """Way to rest of a joint that brakes as hard as it may from the next step on."""
    steps = np.arange(int(speed / (deceleration * dt)) + 2)
    return float(np.maximum(speed - steps * deceleration * dt, 0.0).sum() * dt)


class _Rollout:
    """A motion from rest, every velocity chosen inside the box of its step.

    Attributes:
        relaxed: acceleration bounds given up, over all steps.
        overshoot: largest way beyond a position limit.
        acceleration: the largest and the smallest that occurred.
        speed: the largest and the smallest that occurred.
    """

    def __init__(
        self,
        below: Array,
        above: Array,
        velocity: object,
        acceleration: object,
        dt: float,
        choices: Array,
        braking: Braking = "viable",
    ) -> None:
        self.relaxed = 0
        self.overshoot = -np.inf
        x, v = np.zeros(len(below)), np.zeros(len(below))
        applied = [v]
        for choice in choices:
            limits = limits_at_distances(
                x + below, above - x, velocity=velocity, acceleration=acceleration
            )
            box = velocity_box(limits, v, dt, braking)
            assert np.all(box.lower <= box.upper)
            self.relaxed += int(box.relaxed)
            v = np.clip(box.lower + choice * (box.upper - box.lower), box.lower, box.upper)
            x = x + v * dt
            applied.append(v)
            self.overshoot = max(
                self.overshoot, float(np.max(x - above)), float(np.max(-below - x))
            )
        accelerations = np.diff(applied, axis=0) / dt
        self.acceleration = (accelerations.max(axis=0), accelerations.min(axis=0))
        self.speed = (np.max(applied, axis=0), np.min(applied, axis=0))


choices_of_a_joint = st.one_of(
    st.just([1.0]),  # always as far up as the box allows
    st.just([0.0]),
    st.lists(st.sampled_from([0.0, 1.0]), min_size=1, max_size=40),  # bang-bang
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40),
)


@settings(deadline=None, max_examples=25)
@given(
    below=distances,
    above=distances,
    velocity=st.tuples(speeds, speeds),
    acceleration=st.tuples(accelerations, accelerations),
    dt=periods,
    choices=choices_of_a_joint,
    hold=st.integers(1, 12),
)
def test_viable_box_is_never_empty_along_its_own_motions(
    below: float,
    above: float,
    velocity: tuple[float, float],
    acceleration: tuple[float, float],
    dt: float,
    choices: list[float],
    hold: int,
) -> None:
    """From rest on, any choice inside the box: nothing is given up and no limit is passed."""
    (v_down, v_up), (a_down, a_up) = velocity, acceleration
    motion = _Rollout(
        np.array([below]),
        np.array([above]),
        (-v_down, v_up),
        (-a_down, a_up),
        dt,
        np.resize(np.repeat(choices, hold), 250),
    )
    assert motion.relaxed == 0
    assert motion.overshoot <= 1e-12
    assert motion.acceleration[0] <= a_up * (1 + 1e-9) + 1e-9
    assert motion.acceleration[1] >= -a_down * (1 + 1e-9) - 1e-9
    assert -v_down <= motion.speed[1]
    assert motion.speed[0] <= v_up


@pytest.mark.parametrize(
    ("greedy", "dt"),
    [
        pytest.param(greedy, dt, marks=() if (turn + greedy) % 2 else pytest.mark.long)
        for greedy in (True, False)
        for turn, dt in enumerate((1e-3, 4e-3, 0.01, 0.037))
    ],
)
def test_viable_box_holds_for_many_joints_over_long_runs(dt: float, greedy: bool) -> None:
    """64 unlike joints over 1500 steps: no relaxation and no overshoot above 1e-12.

    The normal run has choices at random and always the upper bound in turns.
    """
    random = np.random.default_rng(int(1e4 * dt) + greedy)
    n, steps = 64, 1500
    choices = (
        np.ones((steps, n))
        if greedy
        # Extremes in bursts, so that speed builds up, and anything between.
        else np.clip(np.repeat(random.uniform(-1, 2, (steps // 10, n)), 10, axis=0), 0, 1)
    )
    motion = _Rollout(
        10 ** random.uniform(-4, 0.5, n),
        10 ** random.uniform(-4, 0.5, n),
        10 ** random.uniform(-1, 1, n),
        10 ** random.uniform(-0.3, 1.7, n),
        dt,
        choices,
    )
    assert motion.relaxed == 0
    assert motion.overshoot <= 1e-12


def test_viable_motion_arrives_at_the_limit() -> None:
    """The brake is not merely safe: a joint that always takes the upper bound gets to the limit."""
    motion = _Rollout(np.ones(1), np.ones(1), 2.0, 20.0, 1e-3, np.ones(2000))
    assert motion.overshoot == pytest.approx(0.0, abs=1e-9)
    assert motion.speed[0] == pytest.approx(2.0)


@pytest.mark.parametrize("vmax", [2.0, 3.14, 10.0])
def test_sqrt_braking_is_not_recursively_feasible(vmax: float) -> None:
    """Science fact 4: at 1 ms the sqrt box is empty on many ticks and asks for far more than 20.

    From rest, 1 rad before the limit, a = 20 rad/s^2: 96, 154 and 220 empty boxes and up to 35, 30
    and 38 rad/s^2 at vmax = 2, 3.14 and 10 rad/s; the viable box: none, and 20.
    """
    unsafe, viable = (
        _Rollout(np.ones(1), np.ones(1), vmax, 20.0, 1e-3, np.ones(1000), braking)
        for braking in ("sqrt", "viable")
    )
    assert unsafe.relaxed > 50
    assert unsafe.acceleration[1] < -30.0
    assert viable.relaxed == 0
    assert viable.acceleration[1] >= -20.0 * (1 + 1e-6)


@pytest.mark.parametrize(("distance", "deceleration"), [(1.0, 36.9), (np.pi, 39.9)])
def test_sqrt_braking_leaves_121_empty_boxes(distance: float, deceleration: float) -> None:
    """Science fact 4 to the tick: 1 ms, a = 20 rad/s^2, vmax = 2.5 rad/s, from rest.

    The decelerations that the empty boxes ask for depend on where the grid of steps meets the
    limit: 36.9 rad/s^2 from 1 rad away, 39.9 from pi (37 to 40 are printed).
    """
    away = np.full(1, distance)
    unsafe = _Rollout(away, away, 2.5, 20.0, 1e-3, np.ones(2000), "sqrt")
    assert unsafe.relaxed == 121
    assert -unsafe.acceleration[1] == pytest.approx(deceleration, abs=0.1)


def test_sqrt_braking_passes_the_limit_where_acceleration_is_kept() -> None:
    """Science fact 4: a drive that cannot exceed 20 rad/s^2 runs through the limit under sqrt."""
    dt, a = 1e-3, np.array([20.0])
    farthest = {}
    for brake in (sqrt_brake, viable_brake):
        x, v = np.zeros(1), np.zeros(1)
        farthest[brake] = 0.0
        for _ in range(2000):
            bound = np.minimum(2.0, brake(1.0 - x, a, dt))
            v = np.clip(bound, v - a * dt, v + a * dt)
            x = x + v * dt
            farthest[brake] = max(farthest[brake], float(x[0]))
    assert farthest[sqrt_brake] > 1.0 + 1e-6
    assert farthest[viable_brake] <= 1.0 + 1e-12


@settings(deadline=None, max_examples=300)
@given(distance=distances, deceleration=accelerations, dt=periods)
def test_viable_brake_is_the_fastest_speed_that_still_stops(
    distance: float, deceleration: float, dt: float
) -> None:
    """Brute force: from that speed the hardest stop ends exactly on the limit."""
    speed = float(viable_brake(np.array([distance]), np.array([deceleration]), dt)[0])
    assert _stopping_distance(speed, deceleration, dt) == pytest.approx(distance, rel=1e-9)
    assert _stopping_distance(speed * (1 + 1e-6), deceleration, dt) > distance


def test_brakes_at_their_corners() -> None:
    """On the limit and outside it nothing is allowed; unlimited joints are not braked at all."""
    a, unlimited = np.array([5.0]), np.array([np.inf])
    for brake in (viable_brake, sqrt_brake):
        assert brake(np.zeros(1), a, 0.01) == 0
        assert brake(np.array([-0.3]), a, 0.01) == 0
        assert brake(unlimited, a, 0.01) == np.inf
        assert brake(np.array([0.3]), unlimited, 0.01) == np.inf
        assert brake(unlimited, unlimited, 0.01) == np.inf
    assert sqrt_brake(np.array([0.4]), a, 0.01) == pytest.approx(2.0)
