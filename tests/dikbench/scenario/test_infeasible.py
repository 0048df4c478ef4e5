"""Proofs that nothing can do a scenario: where a motion exists they must not hold."""

from __future__ import annotations

from dataclasses import replace
from math import asin, pi, sqrt

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import RATE, planar_scenario
from scipy.optimize import minimize

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.robots.collision.obstacles import SphereObstacle
from dikbench.robots.kinematics import placements
from dikbench.scenario import Scenario, joint_oracle, measure_motion, placement_of, solve_placement
from dikbench.scenario.infeasible import infeasible_because
from dikbench.scenario.situation import Situation


def _away(scenario: Scenario, q: Array) -> float:
    """Compute the largest distance from the path of a joint motion (n, nq) [m]."""
    X = placements(scenario.robot, scenario.robot.frame_id, q)
    path = scenario.embedded_path
    assert path is not None
    return float(path.nearest(scenario.embedding.points(X[:, :3, :3], X[:, :3, 3]))[0].max())


# --- beyond the reach


@pytest.mark.parametrize("robot", ["panda", "ur5", "kinova", "tiago", "planar4r"])
def test_a_line_out_of_reach_is_no_and_says_until_when_it_can_be_followed(robot: str) -> None:
    """Where it touches the boundary only, the tolerance helps: nothing is proven."""
    scenario = make_scenario(f"workspace-boundary[robot={robot},extent=1.2]")
    assert scenario.feasible == "no"
    assert "no posture inside the position limits" in scenario.infeasible_because
    assert scenario.comes_back
    until = scenario.followable_until
    assert until is not None
    reach = scenario.robot.reach_of(scenario.reference.placement(until))
    farthest = scenario.robot.reach_of(
        scenario.reference.placement(scenario.reference.duration / 2)
    )
    assert farthest == pytest.approx(1.2 * reach, rel=1e-6)
    touched = make_scenario(f"workspace-boundary[robot={robot},extent=1.0]")
    assert touched.feasible == "unknown"
    still = make_scenario(f"workspace-boundary[robot={robot},extent=1.2,path=still]")
    assert (still.feasible, still.followable_until, still.comes_back) == ("no", 0.0, False)


def test_a_corner_of_the_lwrs_hexagon_is_out_of_reach_and_a_search_agrees() -> None:
    """Too near to the shoulder: bounded minimisation from many seeds stays 2 cm away."""
    scenario = make_scenario("hexagon[robot=lwr,laps=1]")
    assert scenario.feasible == "no"
    assert scenario.motion is not None
    limits = scenario.robot.limits.position
    assert limits is not None
    tau = scenario.motion.instants[scenario.motion.margin.argmin()]
    corner = scenario.reference.placement(tau).translation
    random = np.random.default_rng(0)

    def away(q: Array) -> float:
        return float(np.square(placement_of(scenario.robot, q).translation - corner).sum())

    found = [
        minimize(
            away,
            random.uniform(limits.lower, limits.upper),
            bounds=list(zip(limits.lower, limits.upper, strict=True)),
            method="L-BFGS-B",
        ).fun
        for _ in range(15)
    ]
    assert 0.02 < sqrt(min(found)) < 0.03


# --- a rigid clearance


def _with_obstacle_short_by(short: float) -> Scenario:
    """Make a moving arm with an obstacle that is nearer to its hand than it may be by so much."""
    scenario = make_scenario("obstacle[robot=panda,where=hand,shape=sphere,depth=0.03]")
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    (sphere,) = constraint.obstacles
    assert isinstance(sphere, SphereObstacle)
    # It is 0.03 m inside and should be 0.01 m away: a smaller one is so much less near.
    smaller = replace(constraint, obstacles=(replace(sphere, radius=sphere.radius - 0.04 + short),))
    return replace(
        scenario, constraints=(smaller,), feasible="unknown", infeasible_because="", witness=None
    )


def test_a_hand_inside_an_obstacle_is_no_and_one_that_the_tolerance_frees_is_not() -> None:
    """5 mm, and as much of a turn, free a hand that is 4 mm too near, and none that is 30."""
    assert "task frame's joint carries" in infeasible_because(_with_obstacle_short_by(0.03))
    assert infeasible_because(_with_obstacle_short_by(0.004)) == ""
    wide = replace(_with_obstacle_short_by(0.03), tolerance_m=0.05)
    assert infeasible_because(wide) == ""


def test_no_posture_frees_a_hand_that_is_said_to_be_inside() -> None:
    """A search from many seeds, about the target within the tolerance, finds none that is clear."""
    scenario = make_scenario("obstacle[robot=panda,where=hand,depth=0.02]")
    assert "task frame's joint carries" in scenario.infeasible_because
    assert scenario.motion is not None
    (constraint,) = scenario.constraints
    assert isinstance(constraint, CollisionConstraint)
    robot, motion, random = scenario.robot, scenario.motion, np.random.default_rng(1)
    deepest = int(constraint.distances(robot, motion.q).argmin())
    target = scenario.reference.placement(motion.instants[deepest])
    found = []
    for _ in range(40):
        off = random.normal(size=6)
        off *= scenario.tolerance_m / np.linalg.norm(off * np.repeat([1.0, 0.2], 3))
        seed = pin.integrate(robot.model, motion.q[deepest], random.uniform(-0.8, 0.8, robot.nv))
        try:
            found.append(solve_placement(robot, target * pin.exp6(pin.Motion(off)), seed))
        except DikbenchError:
            continue
    assert len(found) > 20
    assert constraint.distances(robot, np.array(found)).max() < constraint.margin - 1e-3


def test_an_elbow_in_an_obstacle_proves_nothing() -> None:
    """Even without the motion that is known to keep clear."""
    scenario = make_scenario("obstacle[robot=panda,where=elbow]")
    assert scenario.feasible == "time"
    assert infeasible_because(replace(scenario, feasible="unknown", witness=None)) == ""


# --- one branch


@pytest.mark.parametrize("robot", ["ur5", "ur10", "planar3r"])
def test_an_arm_without_null_space_cannot_cross_its_limit(robot: str) -> None:
    """It says which joint, by how much; and not where the tolerance is as large."""
    name = f"joint-limit-crossing[robot={robot},approach=0.3,depth=0.2,speed=0.4]"
    scenario = make_scenario(name)
    assert scenario.feasible == "no"
    assert "0.199 rad outside its limit" in scenario.infeasible_because
    assert scenario.comes_back
    # q_j = q_max - a + (a + d) sin^2(pi t/T) is at its limit where sin^2 = a/(a + d).
    expected = scenario.reference.duration / pi * asin(sqrt(0.3 / 0.5))
    assert scenario.followable_until == pytest.approx(expected, abs=scenario.dt)
    assert infeasible_because(replace(scenario, tolerance_m=0.2)) == ""


def test_what_the_tolerance_mends_is_not_infeasible() -> None:
    """A joint that stops at its limit, 5 mm from the path at most: a motion that does the task."""
    scenario = make_scenario("joint-limit-crossing[robot=planar3r,depth=0.02]")
    assert scenario.motion is not None
    limits = scenario.robot.limits.position
    assert limits is not None
    stopped = np.clip(scenario.motion.q, limits.lower, limits.upper)
    assert _away(scenario, stopped) < scenario.tolerance_m
    assert scenario.feasible == "unknown"


def test_an_arm_with_null_space_is_not_judged_by_one_motion() -> None:
    """Where another one is known, and is taken away; and where no posture is excluded."""
    hexagon = make_scenario("hexagon[robot=planar4r]")
    assert hexagon.feasible == "time"
    assert infeasible_because(replace(hexagon, feasible="unknown", witness=None)) == ""
    # The Panda's wrist turned over reaches the same placements; an elbow's angle is its reach.
    assert make_scenario("joint-limit-crossing[robot=panda]").feasible == "unknown"
    bent = make_scenario("joint-limit-crossing[robot=lwr]")
    assert "no posture inside the position limits" in bent.infeasible_because


def test_a_branch_through_a_singularity_proves_nothing() -> None:
    """At it the arm may go over to the other branch, which keeps the limit."""
    scenario = make_scenario("near-miss[robot=ur5,singularity=wrist,miss=0]")
    assert scenario.motion is not None
    q, robot = scenario.motion.q, scenario.robot
    position = robot.limits.position
    assert position is not None
    leaving = int(np.abs(q[-1] - q[0]).argmax())  # the joint that makes the motion: the wrist
    sign = np.sign(q[-1, leaving] - q[0, leaving])
    lower, upper = position.lower.copy(), position.upper.copy()
    (upper if sign > 0 else lower)[leaving] = (q[0, leaving] + q[-1, leaving]) / 2 + 0.05 * sign
    narrow = robot.with_limits(position=(lower, upper))
    motion = measure_motion(narrow, scenario.motion.instants, q)
    assert motion.margin.min() < -0.1
    assert motion.margin[0] > 0
    asked = replace(scenario, robot=narrow, motion=motion, feasible="unknown", witness=None)
    assert infeasible_because(asked) == ""


def test_a_limit_that_is_left_near_the_end_only_proves_nothing() -> None:
    """Nine tenths of a path are done without it."""
    whole = planar_scenario(duration=0.5)

    def straight(tau: float) -> Array:
        return whole.q0 + tau * RATE

    for share, proven in ((0.05, False), (0.7, True)):
        upper = np.array([3.0, 3.0, straight((1 - share) * 0.5)[2]])
        robot = whole.robot.with_limits(position=([-3.0] * 3, upper))
        motion = joint_oracle(robot, straight, np.linspace(0, 0.5, 51))
        assert bool(infeasible_because(replace(whole, robot=robot, motion=motion))) == proven


# --- what every scenario says


@pytest.mark.parametrize(
    ("selector", "situation"),
    [
        ("obstacle", "obstacles or torques"),
        ("torque-limited", "obstacles or torques"),
        ("start-outside", "start outside"),
        ("step", "steps"),
        ("reach", "steps"),
        ("workspace-boundary[path=still]", "steps"),
        ("joint-limit-crossing", "at joint limits"),
        ("greedy-trap", "at joint limits"),
        ("hold-still[posture=limit]", "at joint limits"),
        ("hold-still[posture=singular]", "near singularities"),
        ("hold-still", "free space"),
        ("near-miss[miss=0.02]", "near singularities"),
        ("near-miss[robot=panda,miss=0.02]", "near singularities"),
        ("near-miss[miss=0]", "free space"),
        ("workspace-boundary", "near singularities"),
        ("speed-sweep[speed=1.3]", "beyond joint speed"),
        ("speed-sweep[speed=0.7]", "free space"),
    ],
)
def test_situations(selector: str, situation: Situation) -> None:
    """The first that holds; a family may say it."""
    assert make_scenario(selector).situation == situation


def test_an_approach_does_not_come_back() -> None:
    """Its path ends beyond the limit, which it reaches at a constant rate."""
    scenario = make_scenario("joint-limit-approach[deceleration=20]")
    assert scenario.motion is not None
    limits = scenario.robot.limits.position
    assert limits is not None
    room = limits.upper[0] - scenario.q0[0]
    assert scenario.followable_until == pytest.approx(room / scenario.v0[0])
    assert not scenario.comes_back
    assert scenario.need == pytest.approx(0.9, rel=1e-3)
