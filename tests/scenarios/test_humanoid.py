"""A humanoid on its feet: they stay, the hand follows, and the certificate says so."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import metrics_of, run_of, scenario_of

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation, make_scenario
from dikbench.plugins.finding import plugins
from dikbench.problem import program_of
from dikbench.problem.tasks import PoseTask
from dikbench.robots.loading import load_robot
from dikbench.scenario import Scenario
from dikbench.scenario.plant import Ideal
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import make_solve
from scenarios.humanoid import FEET_FRAMES


def standing() -> Scenario:
    """The scenario with its defaults."""
    return scenario_of("humanoid")


def run(law: str, scenario: Scenario) -> Array:
    """The configurations of a time-indexed run in which every step is answered, (n + 1, nq)."""
    done = run_of(law, scenario)
    assert done.trace.share(Status.OK) == 1
    return done.trace.q


def placements(scenario: Scenario, frame: str, q: Array) -> list[pin.SE3]:
    """Where a frame is, by forward kinematics of the model alone."""
    model, data = scenario.robot.model, scenario.robot.model.createData()
    found = []
    for sample in q:
        pin.framesForwardKinematics(model, data, sample)
        found.append(data.oMf[model.getFrameId(frame)].copy())
    return found


def slip(scenario: Scenario, q: Array) -> float:
    """The farthest that a foot is from where it was at the start: way and angle (m, rad)."""
    return max(
        float(np.abs(pin.log6(X.actInv(feet[0])).np).max())
        for feet in (placements(scenario, foot, q) for foot in FEET_FRAMES)
        for X in feet
    )


def late(scenario: Scenario, q: Array) -> float:
    """The farthest that the hand is from its target [m]."""
    hand = placements(scenario, scenario.robot.frame, q)
    return max(
        float(np.linalg.norm(X.translation - scenario.target(k * scenario.dt)[0].translation))
        for k, X in enumerate(hand)
    )


def test_robot_is_talos_in_full() -> None:
    """A free base without limits, two legs of 6, a torso of 2, two arms of 7, a head of 2."""
    robot = load_robot("talos-humanoid")
    assert (robot.nq, robot.nv) == (7 + 30, 6 + 30)
    assert robot.model.names[1] == "root_joint"
    position, velocity = robot.limits.position, robot.limits.velocity
    assert position is not None
    assert velocity is not None
    assert np.all(np.isinf(position.upper[:6]))
    assert np.all(np.isinf(velocity.upper[:6]))
    assert np.all(np.isfinite(position.upper[6:]))
    assert np.all(np.isfinite(velocity.upper[6:]))
    # The soles are on the ground, and level but for the 2 mrad that the posture's ankles have.
    scenario = standing()
    for foot in FEET_FRAMES:
        (X,) = placements(scenario, foot, robot.q0[None])
        assert X.translation[2] == pytest.approx(0.0, abs=1e-4)
        assert np.linalg.norm(pin.log3(X.rotation)) < 2e-3


@pytest.mark.parametrize(("law", "lap"), [("hqp", 0.3), ("nullspace", 0.05)])
def test_feet_stay_within_a_micrometre_and_the_hand_follows(law: str, lap: float) -> None:
    """Strict laws at 2 ms: what is left is the second order of the plant's steps."""
    whole = scenario_of("humanoid[laps=1,dt=0.002]")
    scenario = replace(whole, duration=lap * whole.duration)
    q = run(law, scenario)
    assert slip(scenario, q) < 1e-6
    assert late(scenario, q) < 5e-4
    np.testing.assert_allclose(np.linalg.norm(q[:, 3:7], axis=1), 1.0, atol=1e-12)


def test_feet_slip_by_the_plants_second_order_alone() -> None:
    """Half the control period, a quarter of the way: the law itself lets nothing slip."""
    coarse, fine = (make_scenario(f"humanoid[laps=1,dt={dt}]") for dt in (0.01, 0.005))
    ratio = slip(coarse, run("hqp", coarse)) / slip(fine, run("hqp", fine))
    assert ratio == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    ("law", "most"),
    [("hqp", 1.5e-5), ("qp", 1.5e-5), ("pinv", 5e-6), ("dls", 3e-4)],
)
def test_feet_of_laws_of_all_kinds(law: str, most: float) -> None:
    """At 10 ms: 10 um for strict laws and for weights of 100 to 1, a fifth of a mm for damping."""
    scenario = scenario_of("humanoid[laps=1]")
    q = run(law, scenario)
    assert slip(scenario, q) < most
    assert late(scenario, q) < 3e-3
    np.testing.assert_allclose(np.linalg.norm(q[:, 3:7], axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("law", sorted(plugins("formulation")))
def test_every_law_runs_on_a_free_base(law: str) -> None:
    """With nq != nv and 18 rows of first priority: no error, no NaN; five steps are enough."""
    whole, formulation = standing(), make_formulation(law)
    program = program_of(formulation)
    solver = None if program is None else parse_solver(DEFAULT_SOLVER[program])
    scenario = replace(whole, duration=5 * whole.dt)
    done = simulate(scenario, formulation, make_solve(solver, program), Ideal())
    assert (done.status, done.message) == (Status.OK, "")
    # It takes poses and positions alone.
    infeasible = 1.0 if law == "lp-alpha-components" else 0.0
    assert done.trace.share(Status.INFEASIBLE) == infeasible
    assert done.trace.share(Status.NOT_VERIFIED) == done.trace.share(Status.SOLVER_FAILED) == 0


def test_weights_give_way_where_priorities_do_not() -> None:
    """The centre of mass, below the hand: kept by levels, given up by a hundredth of the weight."""
    scenario = scenario_of("humanoid[laps=1]")
    strict, weighted = (metrics_of(law, scenario) for law in ("hqp", "qp"))
    assert strict["second_task_error_rms"] < 1e-4
    assert weighted["second_task_error_rms"] > 50 * strict["second_task_error_rms"]
    assert weighted["position_error_max_m"] < 3e-3


@pytest.mark.parametrize("seed", [0, 3])
def test_oracle_stands_too(seed: int) -> None:
    """The exact motion has the feet where they were, and the hand on the circle."""
    scenario = make_scenario("humanoid[laps=1]", seed)
    q = scenario.oracle
    assert q is not None
    assert slip(scenario, q) < 1e-8
    assert late(scenario, q) < 1e-8


def test_seed_moves_the_arms_alone() -> None:
    """Base, legs, torso and head are where the catalogue has them: the feet are on the ground."""
    start, moved = standing().q0, make_scenario("humanoid", 4).q0
    names = standing().robot.model.names
    arms = np.array([0] * 7 + ["arm" in name for name in names[2:]], dtype=bool)
    assert np.array_equal(start[~arms], moved[~arms])
    assert np.all(start[arms] != moved[arms])


def test_motion_that_leaves_the_ground_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hand's own least motion carries the whole robot away."""
    module = sys.modules["scenarios.humanoid"]
    compute = module.oracle_motion
    for place in (module, sys.modules["dikbench.scenario.family"]):
        monkeypatch.setattr(place, "oracle_motion", lambda *given: compute(*given[:4], PoseTask()))
    with pytest.raises(DikbenchError, match=r"way that the feet move .*, must be"):
        make_scenario("humanoid[speed=0.5]")


def test_robot_that_would_fall_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """On feet of half the length the centre of mass is too near to their edge."""
    monkeypatch.setattr(sys.modules["scenarios.humanoid"], "SOLE_SIZE_M", (0.07, 0.122))
    with pytest.raises(DikbenchError, match=r"centre of mass above the feet .*, must be"):
        make_scenario("humanoid")


@pytest.mark.parametrize(
    ("selector", "words"),
    [
        ("speed=1", "speed=1.0 must be 0.05 to 0.9"),
        ("radius=0.3", "radius=0.3 must be 0.02 to 0.15"),
        ("robot=talos", "robot='talos' is not valid; valid: talos-humanoid"),
    ],
)
def test_what_cannot_be_is_one_line(selector: str, words: str) -> None:
    """What, where, and what would be valid."""
    with pytest.raises(DikbenchError, match=words) as caught:
        make_scenario(f"humanoid[{selector}]")
    assert "\n" not in str(caught.value)
