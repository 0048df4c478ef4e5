"""Motions that show that a scenario can be done: on the path, inside all limits, clear."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from makers.turns import in_turns

from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.kinematics import placements
from dikbench.scenario import Scenario
from dikbench.scenario.family import certified_robots
from dikbench.scenario.witness import does_the_task
from scenarios import SCENARIOS

FOUND = [
    "reach[robot=panda]",
    "step[robot=ur5,distance=0.2,angle=1.5]",
    "obstacle[robot=panda,where=elbow]",
    "obstacle[robot=lwr,where=elbow]",
    "hexagon[robot=planar4r]",
    "hexagon[robot=planar4r,speed=1.2]",
    "hexagon[robot=panda,laps=1]",
    "hexagon[robot=xarm7,laps=1,speed=1.2]",
]
"""Scenarios whose exact motion, if they have one, is no witness."""

EVERY = [
    pytest.param(
        f"{name}[robot={robot}]", seed, marks=() if k == 0 and seed == 0 else pytest.mark.long
    )
    for name, family in SCENARIOS.items()
    if name != "csv"
    for k, robot in enumerate(certified_robots(family))
    for seed in (0, 1)
]
"""The defaults of every family on every robot; the normal run has the first of each."""


def _keeps_what_must_be_kept(scenario: Scenario) -> None:
    witness, robot = scenario.witness, scenario.robot
    assert witness is not None
    q, limits = witness.motion.q, robot.limits
    assert np.array_equal(q[0], scenario.q0)
    if limits.position is not None and scenario.situation != "start outside":
        inside = limits.at(q[0]), *(limits.at(each) for each in q[1:])
        for seen in inside:
            assert seen.to_lower is not None
            assert seen.to_upper is not None
            assert min(seen.to_lower.min(), seen.to_upper.min()) > -1e-8
    for constraint in scenario.constraints:
        if isinstance(constraint, CollisionConstraint):
            assert constraint.distances(robot, q).min() > constraint.margin - 1e-8
    X = placements(robot, robot.frame_id, q)
    points = scenario.embedding.points(X[:, :3, :3], X[:, :3, 3])
    if scenario.reference.moving:
        targets = [scenario.reference.placement(tau) for tau in witness.motion.instants]
    else:
        points = points[-1:]
        targets = [scenario.reference.placement(scenario.reference.duration)]
    wanted = scenario.embedding.points(
        np.array([Y.rotation for Y in targets]), np.array([Y.translation for Y in targets])
    )
    assert np.linalg.norm(points - wanted, axis=1).max() < 1e-6
    if limits.velocity is not None:
        usage = limits.velocity.usage(witness.motion.v).max(axis=1)
        assert (usage * witness.paces).max() <= 1 + 1e-9
        assert witness.by_clock == (usage.max() <= 1 and not scenario.limits_torques)
    if scenario.feasible == "time":
        end = scenario.reference.duration
        assert witness.motion.instants[-1] + witness.lateness <= end + 1e-9


@pytest.mark.parametrize(("selector", "seed"), in_turns(FOUND, [0, 1, 2], every=3))
def test_a_motion_that_was_found_is_a_witness(selector: str, seed: int) -> None:
    """Inside all limits, clear, on the path, or at the target in time."""
    scenario = make_scenario(selector, seed)
    assert scenario.feasible in ("time", "path")
    assert scenario.witness is not None
    assert scenario.motion is not scenario.witness.motion
    assert scenario.followable_until is None
    assert scenario.comes_back
    _keeps_what_must_be_kept(scenario)


@pytest.mark.parametrize(("selector", "seed"), EVERY)
def test_no_scenario_is_both_proven_to_fail_and_done(selector: str, seed: int) -> None:
    """What is feasible has a witness, what is not has a reason, and nothing has both."""
    scenario = make_scenario(selector, seed)
    if scenario.feasible in ("time", "path"):
        assert scenario.infeasible_because == ""
        _keeps_what_must_be_kept(scenario)
    else:
        assert scenario.witness is None
        assert bool(scenario.infeasible_because) == (scenario.feasible == "no")
        assert scenario.followable_until is not None


def test_the_oracle_is_the_motion_that_keeps_clear() -> None:
    """Of an elbow that must turn away: on the path, and clear of the obstacle at every step."""
    scenario = make_scenario("obstacle[robot=panda,where=elbow]")
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    assert scenario.motion is not None
    q: Any = scenario.oracle
    assert constraint.distances(scenario.robot, scenario.motion.q).min() < -0.02
    assert constraint.distances(scenario.robot, q).min() > constraint.margin - 1e-3
    moving = round(scenario.reference.duration / scenario.dt)
    X = placements(scenario.robot, scenario.robot.frame_id, q[: moving + 1])
    for k in range(0, moving, 10):
        target = scenario.reference.placement(k * scenario.dt).homogeneous
        assert np.abs(X[k] - target).max() < 1e-8


def test_a_motion_that_is_off_its_path_or_stops_short_is_no_witness() -> None:
    """By more than rounding: a step whose motion stops short, a graze beside its path."""
    for selector, moving in (("step[robot=ur5]", False), ("joint-limit-graze", True)):
        scenario = make_scenario(selector)
        assert scenario.witness is not None
        assert scenario.reference.moving == moving
        motion, embedding = scenario.witness.motion, scenario.embedding
        assert does_the_task(scenario.robot, motion, scenario.reference, embedding)
        off = motion.q + 1e-4 * (np.arange(len(motion.q)) == len(motion.q) - 1)[:, None]
        beside = replace(motion, q=off)
        assert not does_the_task(scenario.robot, beside, scenario.reference, embedding)
