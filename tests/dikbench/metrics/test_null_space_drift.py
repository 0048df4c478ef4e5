"""Drift per lap: joints that do not come back though the hand does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.metrics import METRICS, Motion, motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.scenario import Scenario
from dikbench.scenario.plant import Ideal
from dikbench.scenario.reference.curves import circle
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.trace import Trace
from dikbench.solvers.checked_solve import make_solve

SWEEP = make_scenario("speed-sweep[robot=panda,speed=0.3,laps=3]")


def drift(scenario: Scenario, v: Array, tau: Array | None = None) -> float:
    """Of a motion of which only the joints are known, from their velocities (n, nv)."""
    n, dt = len(v), scenario.dt
    q = [scenario.q0]
    for velocity in v:
        q.append(pin.integrate(scenario.robot.model, q[-1], velocity * dt))
    nothing, none = np.zeros(n), np.zeros(n, dtype=int)
    times = dt * np.arange(n + 1.0) if tau is None else tau
    trace = Trace(
        dt, np.array(q), times, v, v, v, none, none, none, none, nothing, nothing, nothing, nothing
    )
    nowhere = np.zeros(n + 1)
    motion = Motion(
        trace, scenario, np.zeros((n + 1, 3)), nowhere, nowhere, nowhere, nowhere, nowhere
    )
    return METRICS["null_space_drift_per_lap_rad"].of(motion)


def test_a_constant_creep_is_its_way_per_lap() -> None:
    """Two joints that creep at 3 and 4 mrad/s beside a periodic motion: 5 mrad/s."""
    period = SWEEP.reference.period
    t = SWEEP.dt * np.arange(SWEEP.steps)
    v = np.zeros((SWEEP.steps, 7))
    v[:, 0], v[:, 2] = 3e-3, 4e-3
    v[:, 5] = 0.1 * np.cos(2 * np.pi * t / period)
    assert drift(SWEEP, v) == pytest.approx(5e-3 * period, rel=1e-2)
    v[:, [0, 2]] = 0.0
    assert drift(SWEEP, v) < 1e-3  # the sum of a sampled cosine is not quite its integral


def test_in_a_path_indexed_run_the_phase_is_that_of_the_path() -> None:
    """The same creep at half the pace: twice the way per lap."""
    period, n = SWEEP.reference.period, 2 * SWEEP.steps
    v = np.zeros((n, 7))
    v[:, 0] = 5e-3
    tau = 0.5 * SWEEP.dt * np.arange(n + 1.0)
    assert drift(SWEEP, v, tau) == pytest.approx(2 * 5e-3 * period, rel=1e-6)


def test_a_lap_begins_where_the_reference_says() -> None:
    """What moves before the first lap of the hexagon is no drift."""
    hexagon = make_scenario("hexagon[laps=2,speed=1.0,dt=0.01]")
    first, period = hexagon.reference.first_lap, hexagon.reference.period
    assert period == pytest.approx(1.2)
    assert hexagon.reference.duration == pytest.approx(first + 2 * period)
    v = np.zeros((hexagon.steps, 7))
    v[: int(first / 0.01), 0] = 1.0
    assert drift(hexagon, v) == pytest.approx(0.0, abs=1e-12)
    v[int(first / 0.01) + 2 :, 0] = 0.01
    assert drift(hexagon, v) == pytest.approx(0.012, rel=0.02)


@pytest.mark.parametrize(
    "selector",
    [
        "speed-sweep[laps=3]",
        "speed-sweep[path=lemniscate]",
        "hexagon",
        "back-and-forth[robot=panda]",
    ],
)
def test_what_scenarios_call_a_period_is_one(selector: str) -> None:
    """A period later target and twist are the same, from the first lap on."""
    reference = make_scenario(selector).reference
    last = reference.duration - reference.period
    for tau in np.linspace(reference.first_lap, last, 7)[:-1] + 1e-3:
        here, there = reference.placement(tau), reference.placement(tau + reference.period)
        assert pin.log6(here.actInv(there)).np == pytest.approx(np.zeros(6), abs=1e-9)
        assert reference.velocity(tau) == pytest.approx(
            reference.velocity(tau + reference.period), abs=1e-9
        )


def test_under_the_pseudo_inverse_the_hand_comes_back_and_the_joints_do_not() -> None:
    """The finding of Klein & Huang (1983), on the Panda; far more than the hand is off."""
    run = simulate(SWEEP, make_formulation("pinv"), make_solve(None, None), Ideal())
    motion = motion_of(run.trace, SWEEP, run.jacobians)
    found = METRICS["null_space_drift_per_lap_rad"].of(motion)
    turned = pin.difference(SWEEP.robot.model, motion.trace.q[0], motion.trace.q[-1])
    assert found == pytest.approx(np.linalg.norm(turned) / 3, rel=0.1)
    assert found > 20 * METRICS["contour_error_max_m"].of(motion)


def test_what_has_no_laps_or_no_choice_has_no_drift() -> None:
    """A run that ends before its first lap, a reference without laps, an arm of six joints."""
    still = np.zeros((SWEEP.steps, 7))
    assert drift(SWEEP, still) == 0.0
    assert math.isnan(drift(SWEEP, still[: int(0.9 * SWEEP.reference.period / SWEEP.dt)]))
    assert math.isnan(drift(SWEEP, still[:0]))
    once = replace(SWEEP, reference=replace(SWEEP.reference, period=math.inf))
    assert math.isnan(drift(once, still))
    ur5 = make_scenario("speed-sweep[robot=ur5]")
    assert math.isnan(drift(ur5, np.zeros((ur5.steps, 6))))


def test_a_single_lap_is_compared_at_its_ends() -> None:
    """Its last step may end half a control period early: the last configuration counts."""
    start = SWEEP.reference.placement(0.0)
    one = replace(SWEEP, reference=circle(start, 0.1, 1.004, 1.0), duration=1.004)
    v = np.zeros((one.steps, 7))
    v[:, 1] = 0.01
    assert drift(one, v) == pytest.approx(0.01, rel=1e-9)
