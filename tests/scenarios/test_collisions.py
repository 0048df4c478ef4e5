"""Obstacles and self-collision: who runs into them, who keeps clear, and by how much."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from makers.scenarios import run_of, scenario_error, scenario_of
from makers.turns import in_turns

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.example_robot_data import data_file
from dikbench.robots.kinematics import Kinematics
from dikbench.scenario import Scenario
from dikbench.simulation.closed_loop import Run
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.solvers.interfaces.warm.warm_solver import WORKSPACES

CASES = [
    "obstacle[robot=panda]",
    "obstacle[robot=ur5,shape=capsule]",
    "obstacle[robot=panda,where=elbow,speed=0.6]",
    "obstacle[robot=lwr,where=elbow,shape=box,speed=0.6]",
    "self-collision[robot=panda,speed=0.6]",
    "self-collision[robot=ur5,speed=0.6]",
]

DATA = Path(__file__).parents[1] / "data" / "urdf"

EXACT = 1e-8
"""How far daqp may be from a row [m]."""


def _constraint(scenario: Scenario) -> CollisionConstraint:
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    return constraint


def _errors(run: Run, scenario: Scenario) -> Array:
    return motion_of(run.trace, scenario).position_error


@pytest.mark.parametrize("selector", CASES)
def test_a_law_that_does_not_look_runs_into_it(selector: str) -> None:
    """`dls` follows the path within millimetres, centimetres deep in what stands in its way."""
    scenario = scenario_of(selector)
    run = run_of("dls", scenario)
    distance = _constraint(scenario).distances(scenario.robot, run.trace.q)
    assert distance.min() < -0.02
    assert _errors(run, scenario).max() < 5e-3


@pytest.mark.parametrize(("selector", "law"), in_turns(CASES, ["qp", "hqp", "lp-alpha"], every=3))
def test_distances_fall_below_the_margin_by_the_remainder_and_no_more(
    selector: str, law: str
) -> None:
    """What is left out of the linearisation of a step is all that is missing of the margin."""
    scenario = scenario_of(selector)
    constraint, run = _constraint(scenario), run_of(law, scenario)
    distance = constraint.distances(scenario.robot, run.trace.q)
    remainder = float(constraint.remainders(scenario.robot, run.trace.q).min())
    missing = constraint.margin - float(distance.min())
    print(f"{law} {selector}: {missing:.1e} m below the margin, remainder {remainder:.1e} m")
    assert missing <= -remainder + EXACT
    assert missing < 2e-4
    assert missing > -0.005  # it was needed
    infeasible = run.trace.status == STEP_CODE[Status.INFEASIBLE]
    assert not infeasible.any()


@pytest.mark.parametrize("law", ["qp", "hqp", "lp-alpha"])
def test_the_null_space_keeps_an_elbow_clear(law: str) -> None:
    """The hand stays on its path all the while."""
    scenario = make_scenario("obstacle[robot=panda,where=elbow]")
    assert _errors(run_of(law, scenario), scenario).max() < 1e-3


def test_a_hand_gives_way_and_comes_back_or_stops() -> None:
    """`qp` goes round by what it takes; `lp-alpha`, which never leaves its course, gets stuck."""
    scenario = make_scenario("obstacle[robot=ur5,depth=0.04]")
    error = _errors(run_of("qp", scenario), scenario)
    assert error.max() > 0.04
    assert error[-1] < 2e-3
    stuck = run_of("lp-alpha", scenario)
    assert stuck.trace.share(Status.STUCK) > 0.3
    assert _errors(stuck, scenario)[-1] > 0.1


@pytest.mark.parametrize("where", ["hand", "elbow"])
def test_what_is_in_the_way_is_in_the_way_of_the_hand_or_of_the_elbow(where: str) -> None:
    """Half way the hand itself is `depth` inside, wherever the null space is; or far from it."""
    scenario = make_scenario(f"obstacle[robot=xarm7,where={where}]")
    claims = {claim.quantity: claim.value for claim in scenario.certificate.claims}
    assert ("distance of the hand on its path [m]" in claims) == (where == "hand")
    assert scenario.motion is not None
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.motion.q[len(scenario.motion.q) // 2])
    pairs = _constraint(scenario).pairs(scenario.robot)
    hand = pairs.names.index(("link7_0", "obstacle_0"))
    distance = pairs.distances(kinematics)[hand]
    if where == "hand":
        assert distance == pytest.approx(-0.03, abs=1e-6)
        assert claims["distance of the hand on its path [m]"] == distance
    else:
        assert distance > 0.1


def test_braking_keeps_clear_with_little_acceleration() -> None:
    """The UR5's 6.3 rad/s^2: the margin is kept as well, and every step has an answer."""
    scenario = make_scenario("obstacle[robot=ur5,acceleration=true,speed=0.6]")
    run, constraint = run_of("qp", scenario), _constraint(scenario)
    assert constraint.distances(scenario.robot, run.trace.q).min() > constraint.margin - 1e-4
    assert run.trace.share(Status.INFEASIBLE) == 0
    blind = replace(constraint, influence=0.011)
    late = run_of("qp", replace(scenario, constraints=(blind,)))
    assert constraint.distances(scenario.robot, late.trace.q).min() < constraint.margin - 1e-3


@pytest.mark.filterwarnings(r"ignore::UserWarning:qpsolvers\.")
@pytest.mark.parametrize("name", list(WORKSPACES))
def test_rows_that_come_and_go_do_not_break_a_workspace(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Cold and warm make the motion of daqp, verified at every step, with one workspace throughout.

    Rows are zeros with h = 1 while their pair is far, then anything, then zeros again.
    """
    scenario = make_scenario("obstacle[robot=panda,speed=0.6]")
    expected = run_of("qp", scenario).trace.q
    module = importlib.import_module(f"dikbench.solvers.interfaces.warm.{name}_workspace")
    made, workspace = [], getattr(module, WORKSPACES[name])

    def counted(*given: object, **settings: object) -> object:
        made.append(given)
        return workspace(*given, **settings)

    monkeypatch.setattr(module, WORKSPACES[name], counted)
    for interface in ("cold", "warm"):
        run = run_of("qp", scenario, solver=f"{name}[interface={interface},preset=high]")
        assert (run.trace.verified == 1).all()
        off = np.abs(run.trace.q - expected).max()
        print(f"{name} {interface}: {off:.1e} rad from daqp")
        assert off < 1e-5
    assert len(made) == 1


def test_rows_come_and_go() -> None:
    """On that scenario: at the start few rows say something, half way most, at the end few."""
    scenario = make_scenario("obstacle[robot=panda,speed=0.6]")
    constraint, run = _constraint(scenario), run_of("qp", scenario)
    pairs = constraint.pairs(scenario.robot)
    assert len(pairs) <= constraint.rows
    kinematics, active = Kinematics(scenario.robot), []
    for q in run.trace.q:
        kinematics.update(q)
        G, _ = constraint.linearize(kinematics, None, scenario.dt)
        active.append(int((np.abs(G).max(axis=1) > 0).sum()))
    assert active[0] < 0.6 * max(active)
    assert active[-1] < 0.6 * max(active)


@pytest.mark.parametrize("robot", ["lwr", "baxter.urdf"])
def test_an_obstacle_is_found_for_the_hand_of_any_arm(robot: str) -> None:
    """Without a swing chosen by hand: other limbs stay, a law that does not look runs into it."""
    if robot == "baxter.urdf":
        robot = f"{data_file('baxter_description/urdf/baxter.urdf')},frame=right_gripper"
    scenario = make_scenario(f"obstacle[robot={robot}]")
    arm, motion = scenario.robot, scenario.motion
    assert motion is not None
    moved = np.flatnonzero(np.ptp(motion.q, axis=0) > 1e-9)
    assert set(moved) <= set(arm.limits.q_index[arm.chain])
    run, constraint = run_of("dls", scenario), _constraint(scenario)
    distance = constraint.distances(arm, run.trace.q)
    assert distance[0] > constraint.margin
    assert distance.min() < -0.015
    assert _errors(run, scenario).max() < 5e-3


# --- what does not certify


def test_an_obstacle_that_is_met_at_once_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: a swing so short that it begins inside."""
    module = sys.modules["scenarios.obstacle"]
    short = {"hand": {"panda": replace(module.SWINGS["hand"]["panda"], amplitude=0.05)}}
    monkeypatch.setattr(module, "SWINGS", short)
    with pytest.raises(DikbenchError, match=r"distance at the start .*, must be"):
        make_scenario("obstacle[dt=0.002]")


def test_an_elbow_that_cannot_turn_away_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: the null space is not used, so that no motion is known that does the task."""
    module = sys.modules["scenarios.obstacle"]
    turned = module._turned
    monkeypatch.setattr(module, "_turned", lambda *given: turned(*given[:-1], 0.0))
    with pytest.raises(DikbenchError, match=r"another motion that does it .*, must be"):
        make_scenario("obstacle[where=elbow]")


def test_an_arm_that_stays_unfolded_does_not_certify(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blunted: half the way."""
    module = sys.modules["scenarios.self_collision"]
    half: Mapping[str, object] = MappingProxyType({"ur5": (0.0, 0.0, 0.6, 0.4, 0.0, 0.0)})
    monkeypatch.setattr(module, "DISPLACEMENTS", half)
    with pytest.raises(DikbenchError, match=r"least distance of .* motion .*, must be"):
        make_scenario("self-collision[robot=ur5]")


@pytest.mark.parametrize(
    ("selector", "part"),
    [
        (
            "obstacle[robot=kinova,where=elbow]",
            "robot=kinova with where=elbow; valid: panda, xarm7, lwr",
        ),
        (f"obstacle[robot={DATA / 'base.urdf'},frame=tool]", "the URDF has no collision geometry"),
        ("obstacle[robot=panda,velocity=inf]", "has no velocity limits, from which"),
        ("obstacle[robot=ur5,where=elbow]", "valid: panda, xarm7, lwr"),
        ("obstacle[depth=0.2]", "depth=0.2 must be 0.01 to 0.05"),
        ("obstacle[shape=cone]", "sphere, capsule, box"),
        ("obstacle[speed=2]", "speed=2.0 must be 0.05 to 0.9"),
        ("self-collision[speed=0]", "speed=0.0 must be 0.05 to 0.9"),
        ("self-collision[robot=base]", "robot base has no velocity limits"),
    ],
)
def test_what_cannot_be_is_one_line(selector: str, part: str) -> None:
    """The parameter and its range."""
    assert part in scenario_error(selector)
