"""Plants alone: what they make of commands, and what is seen of the robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dikbench.arrays import Array, read_only
from dikbench.plugins.building import make_scenario
from dikbench.robots.limits import Limits
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.plant import PLANTS, Ideal, Plant, Protective, Saturating

REACH = make_scenario("reach")
"""A Panda, whose v0 is made different from 0 here."""

PLANAR = make_scenario("reach[robot=planar3r]")


def _scenario(**limits: Any) -> Scenario:
    robot = REACH.robot.with_limits(**limits)
    return replace(REACH, robot=robot, v0=np.linspace(-0.3, 0.3, robot.nv))


def _commands(count: int, size: float = 1.0) -> list[Array]:
    random = np.random.default_rng(5)
    return [read_only(size * random.normal(size=REACH.robot.nv)) for _ in range(count)]


@settings(deadline=None)
@given(
    v=arrays(float, 3, elements=st.floats(-20, 20)),
    q=arrays(float, 3, elements=st.floats(-1.5, 1.5)),
    dt=st.floats(1e-3, 0.1),
)
def test_the_saturating_plant_goes_no_further_out(v: Array, q: Array, dt: float) -> None:
    """Inside it ends inside, outside it goes no further out, and no joint waits for another."""
    limits = load_robot("planar3r").with_limits(position=1.0, velocity=2.0).limits.at(q)
    applied = Saturating().drive(v, np.zeros(3), limits, dt)
    after = q + applied * dt
    assert np.all(np.abs(applied) <= 2.0)
    assert np.all(np.abs(after) <= np.maximum(1.0, np.abs(q)) + 1e-12)
    # From inside, what is applied is the command clipped to where it may go.
    for j in np.flatnonzero(np.abs(q) <= 1.0):
        expected = np.clip(np.clip(v[j], -2, 2), (-1 - q[j]) / dt, (1 - q[j]) / dt)
        assert applied[j] == pytest.approx(expected, abs=1e-12)


@given(
    commands=arrays(float, (30, 3), elements=st.floats(-20, 20)),
    delay=st.integers(0, 3),
    dt=st.floats(1e-3, 0.1),
)
def test_the_saturating_plant_keeps_accelerations_where_they_are_in_force(
    commands: Array, delay: int, dt: float
) -> None:
    """From the start on; at an end stop alone a joint brakes harder, and none starts faster."""
    robot = PLANAR.robot.with_limits(position=1.0, velocity=2.0, acceleration=5.0)
    scenario = replace(PLANAR, robot=robot, q0=np.zeros(3), v0=np.array([1.0, 0.0, -2.0]), dt=dt)
    started, q, before = Saturating(delay=delay).start(scenario, 0), scenario.q0, scenario.v0
    for command in commands:
        applied = started.apply(read_only(command), robot.limits.at(q))
        q = q + applied * dt
        too_fast = np.abs(applied - before) > 5.0 * dt * (1 + 1e-9) + 1e-12
        at_stop = np.abs(np.abs(q) - 1.0) < 1e-9
        assert np.all(at_stop[too_fast])
        assert np.all(np.abs(applied[too_fast]) < np.abs(before[too_fast]))
        assert np.all(np.abs(applied) <= 2.0)
        before = applied


def test_the_saturating_plant_clips_to_the_acceleration_and_no_further() -> None:
    """What may be had of a command is had: 5 rad/s^2 for 0.1 s, from the last velocity on."""
    robot = load_robot("planar3r").with_limits(position=None, velocity=2.0, acceleration=5.0)
    limits, before = robot.limits.at(robot.q0), np.array([1.0, -1.0, 1.8])
    applied = Saturating().drive(np.array([1.2, 9.0, 9.0]), before, limits, 0.1)
    assert applied == pytest.approx([1.2, -0.5, 2.0])


def test_without_limits_the_saturating_plant_is_ideal() -> None:
    """Nothing in force clips nothing."""
    free = load_robot("planar3r").with_limits(position=None, velocity=None)
    limits: Limits = free.limits.at(free.q0)
    v = np.array([1e3, -1e3, 0.0])
    assert np.array_equal(Saturating().drive(v, v, limits, 0.01), v)
    assert PLANTS == {"ideal": Ideal, "saturating": Saturating, "protective": Protective}


@pytest.mark.parametrize("kind", PLANTS.values())
@pytest.mark.parametrize("delay", [0, 1, 5])
def test_a_command_is_applied_as_many_steps_late_as_the_delay(
    kind: type[Plant], delay: int
) -> None:
    """At step n that of step n - delay, before that the velocity at the start; read-only."""
    scenario = _scenario(position=None, velocity=None)
    started = kind(delay=delay).start(scenario, 0)
    limits = scenario.robot.limits.at(scenario.q0)
    commands = _commands(12)
    applied = [started.apply(v, limits) for v in commands]
    expected = [*[scenario.v0] * delay, *commands][:12]
    assert np.array_equal(applied, expected)
    assert not any(v.flags.writeable for v in applied)
    assert scenario.v0.flags.writeable  # the scenario is not touched


def test_trials_of_one_plant_share_nothing() -> None:
    """Neither the commands under way nor the random numbers."""
    plant, scenario = Ideal(noise=1e-3, delay=1), _scenario()
    limits = scenario.robot.limits.at(scenario.q0)
    first, second = plant.start(scenario, 1), plant.start(scenario, 1)
    first.apply(_commands(1)[0], limits)
    seen = [first.seen(scenario.q0) for _ in range(3)]
    assert np.array_equal(second.apply(_commands(1)[0], limits), scenario.v0)
    assert np.array_equal([second.seen(scenario.q0) for _ in range(3)], seen)
    assert not np.array_equal(plant.start(scenario, 2).seen(scenario.q0), seen[0])


@pytest.mark.parametrize(("noise", "delay"), [(0.0, 0), (1e-2, 0), (1e-2, 3)])
def test_a_saturating_plant_never_leaves_the_limits(noise: float, delay: int) -> None:
    """Whatever is commanded, seen or late: q inside the position limits, v inside the others."""
    scenario = _scenario(velocity=1.5)
    robot, q = scenario.robot, scenario.q0
    position = robot.limits.position
    assert position is not None
    started, at_limit = Saturating(noise, delay).start(scenario, 0), False
    for k, v in enumerate(_commands(2000, 20.0)):
        started.seen(q)
        push = v + (20.0 if k % 1000 < 500 else -20.0)
        applied = started.apply(push, robot.limits.at(q))
        assert np.abs(applied).max() <= 1.5
        q = pin.integrate(robot.model, q, applied * scenario.dt)
        assert np.all((position.lower - 1e-12 <= q) & (q <= position.upper + 1e-12))
        at_limit |= bool(np.any(np.abs(q - position.upper) < 1e-12))
    assert at_limit


@pytest.mark.parametrize("kind", PLANTS.values())
def test_noise_is_on_what_is_seen_alone(kind: type[Plant]) -> None:
    """The same velocities are applied to the bit; without noise q itself is seen."""
    scenario = _scenario()
    limits = scenario.robot.limits.at(scenario.q0)
    plain, noisy = kind().start(scenario, 0), kind(noise=0.1).start(scenario, 0)
    q = scenario.q0.copy()
    for v in _commands(20, 3.0):
        assert plain.seen(q) is q
        seen = noisy.seen(q)
        assert np.abs(seen - q).max() > 1e-3
        assert not seen.flags.writeable
        assert np.array_equal(plain.apply(v, limits), noisy.apply(v, limits))
    assert np.array_equal(q, scenario.q0)


def test_noise_is_white_and_as_large_as_it_says() -> None:
    """Per joint, in the tangent space: a free base is seen with a quaternion of unit length."""
    scenario = make_scenario("humanoid")
    model, q = scenario.robot.model, scenario.q0
    started = Ideal(noise=1e-3).start(scenario, 4)
    seen = [started.seen(q) for _ in range(400)]
    errors = np.array([pin.difference(model, q, each) for each in seen])
    assert errors.std(axis=0) == pytest.approx(np.full(model.nv, 1e-3), rel=0.2)
    assert np.abs(errors.mean(axis=0)).max() < 3e-4
    assert abs(np.mean(errors[1:] * errors[:-1])) < 2e-8
    assert np.linalg.norm([each[3:7] for each in seen], axis=1) == pytest.approx(1.0)


@dataclass(frozen=True)
class Weak(Plant):
    """A drive that makes a share of what is commanded: a plant of somebody else."""

    share: float = 0.5

    def drive(self, v: Array, v_before: Array, limits: Limits, dt: float) -> Array:
        """See `Plant`."""
        return self.share * v


def test_a_plant_needs_nothing_but_its_drive() -> None:
    """Measurement and delay are there; a parameter of its own stands after them."""
    scenario = _scenario()
    started = Weak(delay=1, share=0.25).start(scenario, 0)
    limits, (a, b) = scenario.robot.limits.at(scenario.q0), _commands(2)
    assert np.array_equal(started.apply(a, limits), 0.25 * scenario.v0)
    assert np.array_equal(started.apply(b, limits), 0.25 * a)
    with pytest.raises(TypeError):
        Plant()  # type: ignore[abstract]
