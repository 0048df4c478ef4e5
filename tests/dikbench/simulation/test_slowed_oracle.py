"""The slowed oracle keeps all limits and does the task; pace and lateness against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from makers.turns import in_turns

from dikbench.metrics import Outcome, judge, motion_of
from dikbench.plugins.building import make_plant, make_scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.slowed_oracle import SlowedOracle
from dikbench.solvers.checked_solve import make_solve

SCENARIOS = (
    "near-miss[miss=0.02,speed=0.5]",
    "speed-sweep[robot=ur5,speed=2.0,laps=1]",
    "torque-limited[robot=ur5]",
    "pick-and-place[robot=ur5]",
    "obstacle[robot=panda,where=elbow]",
    "step[robot=ur5]",
)


@pytest.mark.parametrize(("name", "mode"), in_turns(SCENARIOS, ["time", "path"]))
def test_the_slowed_oracle_does_what_can_be_done(name: str, mode: ReferenceMode) -> None:
    """By the clock where the exact motion keeps its limits, else late or recovered; all limits."""
    scenario = make_scenario(name)
    if mode == "path" and not scenario.reference.moving:
        mode = "time"
    assert scenario.witness is not None
    law = SlowedOracle(scenario)
    run = simulate(scenario, law, make_solve(None, None), make_plant("ideal"), mode)
    judged = judge(motion_of(run.trace, scenario), run.status)
    assert judged.at(scenario.tolerance_m).outcome in {Outcome.SUCCESS, Outcome.RECOVERED}
    assert judged.before is None


def test_the_pace_of_a_circle_at_twice_the_speed() -> None:
    """A joint motion at most 1.9 times too fast somewhere is late by the integral of its excess."""
    scenario = make_scenario("speed-sweep[robot=ur5,speed=1.9,laps=1]")
    motion, witness = scenario.motion, scenario.witness
    assert motion is not None
    assert witness is not None
    excess = np.maximum(motion.speed_ratio, 1.0) - 1.0
    assert witness.lateness == pytest.approx(float(np.diff(motion.instants) @ excess))
    assert witness.paces.min() == pytest.approx(1 / motion.peak_speed_ratio)
    assert scenario.feasible == "path"
    rest = scenario.duration - scenario.reference.duration
    assert rest == pytest.approx(witness.lateness + 1.0, abs=scenario.dt)


def test_a_protective_plant_stops_at_the_first_violation() -> None:
    """The trace ends with the step that broke the limit; the outcome names it."""
    from dikbench.plugins.building import make_formulation
    from dikbench.simulation.status import Status

    for name, outcome in (
        ("near-miss[miss=0.02,speed=0.5]", Outcome.LIMIT_BROKEN),
        ("joint-limit-crossing[robot=ur5]", Outcome.LIMIT_BROKEN),
        ("torque-limited[robot=ur5]", Outcome.LIMIT_BROKEN),
        ("obstacle[robot=ur5]", Outcome.COLLIDED),
        ("start-outside[robot=ur5,rate=0]", Outcome.LIMIT_BROKEN),
    ):
        scenario, law = make_scenario(name), make_formulation("pinv")
        runs = [
            simulate(scenario, law, make_solve(None, None), make_plant(plant))
            for plant in ("ideal", "protective")
        ]
        free, stopped = (judge(motion_of(run.trace, scenario), run.status) for run in runs)
        assert runs[1].status is Status.PROTECTIVE_STOP
        assert free.before is not None
        assert stopped.before is not None
        assert stopped.before.outcome is outcome
        assert (stopped.before.step, stopped.before.outcome) == (
            free.before.step,
            free.before.outcome,
        )
        assert runs[1].trace.steps in (stopped.before.step, stopped.before.step + 1)
        assert "over its limit" in runs[1].message or "distance" in runs[1].message
        assert np.array_equal(runs[1].trace.q, runs[0].trace.q[: runs[1].trace.steps + 1])
