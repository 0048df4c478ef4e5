"""A lift that asks for more torque than there is: what is claimed, and who keeps the limits."""

from __future__ import annotations

import sys

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import run_of, scenario_of

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.robots.loading import load_robot
from dikbench.robots.robot import Robot
from dikbench.scenario import Scenario
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace
from scenarios.torque_limited import TorqueLimited


def usage(robot: Robot, q: Array, v: Array, v_prev: Array, dt: float) -> Array:
    """Largest |torque| over its limit at each step, (n,), by the Newton-Euler algorithm."""
    limit, data = robot.model.effortLimit, robot.model.createData()
    return np.array(
        [
            np.max(np.abs(pin.rnea(robot.model, data, x, before, (now - before) / dt)) / limit)
            for x, now, before in zip(q, v, v_prev, strict=False)
        ]
    )


def usage_of(trace: Trace, scenario: Scenario) -> Array:
    """Likewise of a run."""
    before = np.vstack([scenario.v0, trace.applied[:-1]])
    return usage(scenario.robot, trace.q, trace.applied, before, scenario.dt)


@pytest.mark.parametrize("robot", TorqueLimited.robots)
def test_lift_can_be_held_but_not_done(robot: str) -> None:
    """Gravity takes `load` of the limits at the worst place, the joint motion `demand`.

    The latter from accelerations by central differences of the motion that follows the reference.
    """
    scenario = make_scenario(f"torque-limited[robot={robot},load=0.8,demand=1.2]")
    arm, motion = scenario.robot, scenario.motion
    assert motion is not None
    n = len(motion.q)
    still = np.zeros((n, arm.nv))
    assert usage(arm, motion.q, still, still, 1.0).max() == pytest.approx(0.8, rel=1e-3)
    period = motion.instants[1]
    before, after = motion.v[:-1], motion.v[1:]
    accelerated = (before + after) / 2 + (after - before)  # rnea sees (after - before) / period
    peak = usage(arm, motion.q[1:-1], accelerated, (before + after) / 2, period)
    assert peak.max() == pytest.approx(1.2, rel=0.01)


@pytest.mark.parametrize("robot", TorqueLimited.robots)
def test_qp_and_hqp_keep_the_torques_and_laws_without_limits_pass_them(robot: str) -> None:
    """To 1e-6 at every step, none of them infeasible; the others by a tenth, in a tenth of them."""
    scenario = scenario_of(f"torque-limited[robot={robot}]")
    for law in ("qp", "hqp"):
        trace = run_of(law, scenario).trace
        assert usage_of(trace, scenario).max() < 1 + 1e-6
        assert trace.share(Status.INFEASIBLE) == trace.share(Status.NOT_VERIFIED) == 0
        assert not trace.relaxed.any()
    for law in ("dls", "pinv"):
        used = usage_of(run_of(law, scenario).trace, scenario)
        assert used.max() > 1.1
        moving = round(scenario.reference.duration / scenario.dt)  # then the target is at rest
        assert np.mean(used[:moving] > 1) > 0.1


@pytest.mark.parametrize("law", ["lp-alpha", "alpha-two-stage"])
@pytest.mark.parametrize("robot", TorqueLimited.robots)
def test_alpha_scaling_keeps_them_wherever_it_has_an_answer(law: str, robot: str) -> None:
    """It cannot brake off its direction: mostly feasible, and the rest is counted.

    Where it is not, the fallback brakes as fast as the torques allow.
    """
    scenario = scenario_of(f"torque-limited[robot={robot}]")
    trace = run_of(law, scenario).trace
    used = usage_of(trace, scenario)
    infeasible = trace.status == STEP_CODE[Status.INFEASIBLE]
    assert used[~infeasible].max() < 1 + 1e-6
    assert used[infeasible].max(initial=0.0) < 1 + 1e-6
    assert trace.share(Status.INFEASIBLE) < 0.2


@pytest.mark.parametrize("robot", TorqueLimited.robots)
def test_lighter_payload_or_slower_lift_does_not_certify(
    monkeypatch: pytest.MonkeyPatch, robot: str
) -> None:
    """Half the mass, or half the speed: an error, not a quiet run."""
    module = sys.modules["scenarios.torque_limited"]
    for name, factor in (("_heaviest", 0.5), ("_shortest", 2.0)):
        compute = getattr(module, name)
        with monkeypatch.context() as patch:
            patch.setattr(module, name, lambda *given, c=compute, f=factor: f * c(*given))
            if name == "_heaviest":  # in the time that suits the whole mass
                patch.setattr(module, "_shortest", lambda *given: 0.4)
            with pytest.raises(DikbenchError, match=r"torque of the motion over limit .*, must be"):
                make_scenario(f"torque-limited[robot={robot}]")


def test_payload_of_another_mass_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth more than the load asks for, lifted so that the torques of the motion are right."""
    module = sys.modules["scenarios.torque_limited"]
    compute = module._heaviest
    monkeypatch.setattr(module, "_heaviest", lambda *given: 1.1 * compute(*given))
    with pytest.raises(DikbenchError, match=r"torque to hold it over limit .*, must be"):
        make_scenario("torque-limited")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("robot=planar4r", "planar4r"),
        ("robot=base", "effort limits"),
        ("robot=talos", "takes .* of its effort limits to hold itself; load=0.85"),
        ("demand=1", "demand=1.0 must be 1.12 to 2"),
        ("load=1", "load=1.0 must be 0.3 to 0.9"),
        ("height=0.5", "height=0.5 must be 0.02 to 0.3"),
    ],
)
def test_what_cannot_be_lifted_is_one_line(selector: str, words: str) -> None:
    """What, where, and what would be valid."""
    with pytest.raises(DikbenchError, match=words) as caught:
        make_scenario(f"torque-limited[{selector}]")
    assert "\n" not in str(caught.value)


def test_payload_is_the_scenarios_own() -> None:
    """The robot of the catalogue does not carry it."""
    scenario, plain = make_scenario("torque-limited"), load_robot("panda")
    assert pin.computeTotalMass(scenario.robot.model) > pin.computeTotalMass(plain.model) + 5
