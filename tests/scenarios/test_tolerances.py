"""Tolerances of scenarios: measured again in closed loop, by the rule that they follow."""

from __future__ import annotations

import pytest

from dikbench.metrics import motion_of
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import scenario_plugin
from dikbench.scenario import Family, Scenario
from dikbench.scenario.plant import Ideal
from dikbench.selector import parse_selector
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.slowed_oracle import SlowedOracle
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import make_solve
from dikbench.study.study import load_study

LADDER_M = (0.001, 0.002, 0.005, 0.01, 0.02)

NORMAL_RUN = {
    "near-miss[robot=ur5,singularity=wrist,miss=0.005,speed=1.0]": 0.005,
    "speed-sweep[robot=panda,speed=0.7]": 0.005,
    "speed-sweep[robot=panda,speed=2.0]": 0.01,
    "speed-sweep[robot=ur5,speed=1.3]": 0.01,
    "speed-sweep[robot=ur10,speed=2.0]": 0.02,
    "pick-and-place[robot=ur10,speed=1.2]": 0.01,
    "pick-and-place[robot=ur5,speed=0.8]": 0.005,
    "start-outside[robot=ur5,outside=5e-3]": 0.002,
    "hold-still[robot=panda]": 0.001,
    "torque-limited[robot=ur5]": 0.005,
    "joint-limit-graze[robot=ur5,speed=0.8]": 0.01,
    "joint-limit-graze[robot=panda,speed=0.8]": 0.005,
    "joint-limit-detour[robot=panda,speed=0.8]": 0.005,
    "obstacle[robot=panda,where=elbow]": 0.005,
    "task-conflict[robot=panda,speed=0.3]": 0.005,
    "greedy-trap": 0.005,
    "reach[robot=panda]": 0.005,
}
"""Scenarios and their tolerances [m]."""


def _floor(scenario: Scenario) -> float:
    """Measure what an exact law has: the pseudo-inverse's, at a singularity the slowed motion's.

    Of a target at rest it is where the slowed motion ends.
    """
    pinv = scenario.reference.moving and scenario.situation != "near singularities"
    law = make_formulation("pinv") if pinv else SlowedOracle(scenario)
    run = simulate(scenario, law, make_solve(None, None), Ideal(), "time")
    assert run.status is Status.OK
    motion = motion_of(run.trace, scenario)
    if not scenario.reference.moving:
        return float(motion.tracking_error[-1])
    return float(motion.contour_error_6d.max())


def _check(selector: str, seed: int) -> Scenario:
    """The smallest rung that is at least the family's own and one and a half times the floor."""
    scenario = make_scenario(selector, seed)
    family = scenario_plugin(parse_selector(selector).name).factory
    assert issubclass(family, Family)
    default = family.tolerance_m
    if scenario.feasible in ("time", "path"):
        least = max(default, 1.5 * _floor(scenario))
        assert scenario.tolerance_m == min((t for t in LADDER_M if t >= least), default=0.02)
    else:
        assert scenario.tolerance_m == default
    return scenario


@pytest.mark.parametrize(("selector", "tolerance"), NORMAL_RUN.items())
def test_a_tolerance_is_measured_again(selector: str, tolerance: float) -> None:
    """One and a half times what sampling takes, and the family's own; at the number of today."""
    assert _check(selector, 0).tolerance_m == tolerance
    assert make_scenario(selector).judged == ("end" if selector == "greedy-trap" else "path")


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("selector", load_study("full").scenarios)
def test_every_tolerance_of_full_is_measured_again(selector: str, seed: int) -> None:
    """Of each scenario that something can do."""
    _check(selector, seed)
