"""Our versions of the peers' laws against the peers' own answers on 440 random states of four arms.

The peers' answers are in tests/data/peers/random_states.npz, from the script beside it. Where a
peer claims an answer that breaks its own constraints, or that costs more than ours, it is no
reference; how many those are is part of what is asserted.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from makers.problems import KeepsProgram, kinematics_at, problem_at
from makers.turns import in_turns

from dikbench import DikAnswer, Robot, Status, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.problem import DikProblem
from dikbench.problem.tasks import PoseTask, PostureTask
from dikbench.robots.kinematics import Kinematics
from formulations.lu_kernel import lu_kernel

DT = 0.01
ARMS = ("panda", "ur5", "ur10", "xarm7")
EXACT = "daqp[preset=high]"
KEPT = np.load(Path(__file__).parents[1] / "data" / "peers" / "random_states.npz")


def limited(name: str, *, acceleration: bool) -> Robot:
    """An arm with position and velocity limits in force, and acceleration limits where asked."""
    robot = load_robot(name)
    if not acceleration:
        return robot
    return robot.with_limits(acceleration=robot.available_acceleration)


def jacobian(robot: Robot, q: Array) -> Array:
    """The body Jacobian of the task frame, (6, nv)."""
    kinematics = Kinematics(robot)
    kinematics.update(q)
    return kinematics.jacobian(robot.frame_id)


def nominal(q: Array) -> Array:
    """The posture that the peers were asked for."""
    near: Array = q + 0.3 * np.cos(np.arange(len(q)))
    return near


# --- Drake's function


def drake_bounds(robot: Robot, q: Array, before: Array) -> tuple[Array, Array]:
    """Drake's own bounds on v, written down from its documentation, (nv,) each."""
    limits = robot.limits
    assert limits.position is not None
    assert limits.velocity is not None
    lower = np.maximum(limits.velocity.lower, (limits.position.lower - q) / DT)
    upper = np.minimum(limits.velocity.upper, (limits.position.upper - q) / DT)
    if limits.acceleration is not None:
        lower = np.maximum(lower, before + limits.acceleration.lower * DT)
        upper = np.minimum(upper, before + limits.acceleration.upper * DT)
    return lower, upper


def stability_of(
    robot: Robot, gain: float, q: Array, before: Array, V: Array, theirs: Array, ours: DikAnswer
) -> str:
    """What an answer of Drake's is worth beside ours, and by how much."""
    if np.isnan(theirs).any():
        return "unsolved"
    J = jacobian(robot, q)
    alpha = float((J @ theirs) @ V / (V @ V))
    if np.abs(theirs - ours.velocity).max() < 1e-4 and abs(alpha - ours.progress) < 1e-6:
        return "same"
    lower, upper = drake_bounds(robot, q, before)
    passed = np.concatenate([lower - theirs, theirs - upper, [alpha - 1, -alpha]]).max()
    off = np.abs(J @ theirs - alpha * V).max()
    if max(passed, off) > 1e-6:
        print(f"\n  passes a bound by {passed:.1e} and J v = alpha V by {off:.1e}", end="")
        return "breaks its constraints"
    kernel = lu_kernel(np.roll(J, 3, axis=0))

    def cost(v: Array) -> float:
        penalty = kernel.T @ (v - gain * (robot.q0 - q)) if kernel.size else np.zeros(1)
        return float(-100 * (J @ v) @ V / (V @ V) + penalty @ penalty)

    more = cost(theirs) - cost(ours.velocity)
    print(f"\n  costs {more:.1e} more", end="")
    return "costs more" if more > 0 else "different"


# (arm, gain, acceleration limits): answers of 110 that break their own constraints, by up to
# 6e-3 rad/s or 1e-5 in alpha, and that cost more than ours. All are OSQP's: for arms of six joints
# Drake's program is linear and goes to CLP.
NO_REFERENCE = {
    ("panda", 0, True): (5, 0),
    ("panda", 1, True): (5, 0),
    ("panda", 10, False): (1, 0),
    ("panda", 10, True): (5, 1),
    ("xarm7", 0, False): (1, 0),
    ("xarm7", 0, True): (5, 0),
    ("xarm7", 1, True): (4, 0),
    ("xarm7", 10, False): (1, 0),
    ("xarm7", 10, True): (3, 0),
}


@pytest.mark.parametrize(
    ("name", "gain", "acceleration"), in_turns(ARMS, [0, 1, 10], [False, True])
)
def test_drakes_function(name: str, gain: int, acceleration: bool) -> None:
    """Velocity to 1e-4 rad/s and alpha to 1e-6 wherever Drake's answer is one.

    Where it gives up, our program has no answer either, or an alpha below the 0.01 at which Drake
    calls itself stuck.
    """
    robot = limited(name, acceleration=acceleration)
    law = f"drake[centering={gain}]"
    posture = [PostureTask(target=robot.q0)] if gain else []  # else it does not look at one
    verdicts: Counter[str] = Counter()
    for q, before, V, theirs in zip(
        *(KEPT[f"{name}/{key}"] for key in ("q", "v_prev", "V")),
        KEPT[f"{name}/drake/K{gain}{'a' * acceleration}"],
        strict=True,
    ):
        ours = solve_dik(
            robot, q, formulation=law, twist=V, dt=DT, reference_frame="LOCAL", solver=EXACT,
            v_prev=before, tasks=posture,
        )  # fmt: skip
        found = stability_of(robot, gain, q, before, V, theirs, ours)
        if found == "unsolved":
            assert ours.status is not Status.OK or ours.progress < 0.01 + 1e-6
        verdicts[found] += 1
    assert verdicts["different"] == 0
    wrong = verdicts["breaks its constraints"], verdicts["costs more"]
    assert wrong == NO_REFERENCE.get((name, gain, acceleration), (0, 0))
    assert verdicts["same"] > 60


# --- Drake's system

SAME = {"panda": 57, "ur5": 45, "ur10": 47, "xarm7": 49}
"""Of 110 answers, how many are ours to 1e-4 rad/s; the others cost more: OSQP has stopped early."""


@pytest.mark.parametrize("name", ARMS)
def test_drakes_system(name: str) -> None:
    """The same velocity or a cheaper one, in Drake's own cost: its kernel in the world's axes."""
    robot, kinematics = load_robot(name), Kinematics(load_robot(name))
    same = 0
    for q, V, theirs in zip(
        *(KEPT[f"{name}/{key}"] for key in ("q", "V", "drake-system/v")), strict=True
    ):
        ours = solve_dik(
            robot, q, formulation="drake-system", twist=V, dt=DT, reference_frame="LOCAL",
            solver=EXACT, tasks=[PostureTask(target=nominal(q))],
        ).velocity  # fmt: skip
        if np.abs(ours - theirs).max() < 1e-4:
            same += 1
            continue
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)
        R = kinematics.placement(robot.frame_id).rotation
        kernel = lu_kernel(np.vstack([R @ J[3:], R @ J[:3]]))
        costs = []
        for v in (ours, theirs):
            penalty = kernel.T @ (v - (nominal(q) - q)) if kernel.size else np.zeros(1)
            costs.append(100 * float((J @ v - V) @ (J @ v - V)) + float(penalty @ penalty))
        assert costs[0] < costs[1]
    assert same == SAME[name]


# --- Pink and mink


def peer_problem(robot: Robot, q: Array, before: Array, V: Array) -> DikProblem:
    """Their frame task towards the pose moved by dt V, and their posture task, dead-beat."""
    kinematics = kinematics_at(robot, q)
    target = kinematics.placement(robot.frame_id) * pin.exp6(pin.Motion(DT * V))
    tasks = [
        PoseTask(target=target, gain=1 / DT).linearize(kinematics),
        PostureTask(target=nominal(q), gain=1 / DT, weight=1e-4).linearize(kinematics),
    ]
    return problem_at(robot, q, tasks, before, DT)


CONFLICTS = {("panda", "pink-a"): 9, ("xarm7", "pink-a"): 2}
"""States in which Pink's limits contradict each other: it finds no solution, ours gives one up."""


@pytest.mark.parametrize("peer", ["pink", "pink-a", "mink"])
@pytest.mark.parametrize("name", ARMS)
def test_programs_and_velocities_of_pink_and_mink(name: str, peer: str) -> None:
    """P (by a product with a vector), q and the bounds that G and h are; and v to 1e-6 rad/s.

    `pink-a` is Pink with its acceleration limit. mink's Jlog6 rounds more than Pink's.
    """
    robot = limited(name, acceleration=peer == "pink-a")
    law = make_formulation("mink-qp" if peer == "mink" else "pink-qp")
    probe, conflicts = np.cos(np.arange(robot.nv) ** 2), 0
    square = f"{name}/{peer.removesuffix('-a')}"  # the cost has no limits in it
    for q, before, V, Pw, linear, lower, upper, theirs in zip(
        *(KEPT[f"{name}/{key}"] for key in ("q", "v_prev", "V")),
        *(KEPT[f"{square}/{key}"] for key in ("Pw", "q")),
        *(KEPT[f"{name}/{peer}/{key}"] for key in ("lower", "upper", "v")),
        strict=True,
    ):
        kept, problem = KeepsProgram(EXACT), peer_problem(robot, q, before, V)
        v = law.velocity(problem, kept)
        program = kept.program
        assert program is not None
        assert program.lb is not None
        assert program.ub is not None
        np.testing.assert_allclose(program.P @ probe, Pw, rtol=0, atol=1e-9)
        np.testing.assert_allclose(program.q * DT, linear, rtol=0, atol=1e-10)
        assert (problem.relaxed > 0) == np.isnan(theirs).any() == np.any(lower > upper)
        if problem.relaxed:
            conflicts += 1
            continue
        np.testing.assert_allclose(program.lb * DT, lower, rtol=0, atol=1e-14)
        np.testing.assert_allclose(program.ub * DT, upper, rtol=0, atol=1e-14)
        np.testing.assert_allclose(v, theirs, rtol=0, atol=1e-6)
    assert conflicts == CONFLICTS.get((name, peer), 0)
