"""Plants that measure with noise and act late: what the law sees, when its commands arrive."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from makers.scenarios import RATE, error_of, exact, planar_scenario

from dikbench.arrays import Array
from dikbench.plugins.building import make_plant
from dikbench.problem import DikProblem, Solve
from dikbench.problem.tasks import PoseTask
from dikbench.scenario.plant import Ideal, Plant, Saturating
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.solvers.checked_solve import make_solve
from dikbench.study.identity import trial_id
from dikbench.study.trial import Trial

SCENARIO = planar_scenario(duration=2.0, gain=5.0)


class _Law:
    """The exact law; it keeps what it saw."""

    def __init__(self) -> None:
        self.seen: list[Array] = []
        self.before: list[Array] = []

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        self.seen.append(problem.q)
        assert problem.v_prev is not None
        self.before.append(problem.v_prev)
        return exact(problem)


def _run(law: Any, plant: Plant, seed: int = 0) -> Run:
    return simulate(SCENARIO, law, make_solve(None, None), plant, "time", seed)


def test_a_late_command_is_applied_so_many_steps_later() -> None:
    """Until the first one arrives the robot keeps the velocity that it had at the start."""
    law = _Law()
    trace = _run(law, Ideal(delay=3)).trace
    assert np.array_equal(trace.applied[3:], trace.commanded[:-3])
    assert np.array_equal(trace.applied[:3], np.tile(RATE, (3, 1)))
    # The law is told what was applied, not what it commanded.
    assert np.array_equal(np.array(law.before)[1:], trace.applied[:-1])


def test_without_delay_commands_are_applied_at_once() -> None:
    """The plain plant."""
    trace = _run(_Law(), Ideal()).trace
    assert np.array_equal(trace.applied, trace.commanded)


def test_a_delay_makes_a_tight_loop_unstable() -> None:
    """A gain of 60/s at 10 ms, far from its limit of 2/dt, oscillates when 5 steps late."""

    def final_error(delay: int) -> float:
        fast = replace(SCENARIO, tracking=PoseTask(gain=60.0), q0=SCENARIO.q0 + 0.01)
        run = simulate(fast, _Law(), make_solve(None, None), Ideal(delay=delay))
        end = run.trace.q[-1] - (SCENARIO.q0 + 2.0 * RATE)
        return float(np.abs(end).max())

    assert final_error(0) < 1e-6
    assert final_error(5) > 0.1


def test_noise_is_on_what_is_seen_not_on_the_robot() -> None:
    """The law sees q plus white noise of the given size; what is recorded is the true motion."""
    law = _Law()
    trace = _run(law, Ideal(noise=1e-3)).trace
    noise = np.array(law.seen) - trace.q[:-1]
    assert noise.std() == pytest.approx(1e-3, rel=0.1)
    assert abs(noise.mean()) < 2e-4
    neighbours = (noise[1:] * noise[:-1]).mean() / noise.var()
    assert abs(neighbours) < 0.1  # white
    steps = np.diff(trace.q, axis=0)
    assert steps == pytest.approx(trace.applied * 0.01)


def test_the_trials_seed_is_the_noises() -> None:
    """The same seed sees the same noise, another one another."""
    a, b, c = (_run(_Law(), Ideal(noise=1e-3), seed).trace.q for seed in (1, 1, 2))
    assert np.array_equal(a, b)
    assert np.abs(a - c).max() > 1e-5


def test_the_saturating_drive_clips_by_the_true_configuration() -> None:
    """Noise on the measurement does not let the robot through its limit."""
    upper = SCENARIO.q0 + 0.05
    robot = SCENARIO.robot.with_limits(position=(SCENARIO.q0 - 1.0, upper))
    tight = replace(SCENARIO, robot=robot)
    run = simulate(tight, _Law(), make_solve(None, None), Saturating(noise=1e-2))
    assert np.all(run.trace.q <= upper + 1e-12)
    assert np.abs(run.trace.q.max(axis=0) - upper).min() < 1e-12


def test_selectors_of_plants() -> None:
    """A name, or a name with noise and delay."""
    assert make_plant("ideal") == Ideal()
    assert make_plant("saturating[noise=1e-3,delay=2]") == Saturating(1e-3, 2)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("idle", ["unknown plant 'idle'", "'ideal'", "saturating"]),
        ("ideal[noise=-1]", ["noise=-1.0 must be finite and at least 0"]),
        ("ideal[noise=inf]", ["noise=inf must be finite"]),
        ("ideal[delay=1001]", ["delay=1001 must be 0 to 1000 [steps]"]),
        ("ideal[delay=0.5]", ["delay='0.5' is not valid"]),
        ("ideal[lag=1]", ["unknown parameter of plant ideal 'lag'", "delay, noise"]),
        ("ideal[drive=x]", ["unknown parameter of plant ideal 'drive'"]),
    ],
)
def test_wrong_plants_are_errors_of_one_line(text: str, parts: list[str]) -> None:
    """What, where, what would be valid."""
    message = error_of(make_plant, text)
    for part in parts:
        assert part in message


def test_a_plant_that_means_the_same_is_the_same_trial() -> None:
    """A default that is spelt out changes no id; noise and delay do."""

    def name(plant: str) -> str:
        return trial_id(Trial.of("dls", "reach", "none", plant, "time", 0))

    assert name("ideal") == name("ideal[noise=0]") == name("ideal[delay=0]")
    others = ("ideal", "ideal[noise=1e-4]", "ideal[delay=1]", "saturating")
    assert len({name(plant) for plant in others}) == 4
