"""Proofs that no motion does a scenario, whatever formulation commands it.

A motion that keeps the position limits and the distances must come within the tolerance of every
sample of the first nine tenths of the path, or of a target at rest. There is none where one of
these samples is beyond the reach of every posture; where what the task frame's joint carries is
inside an obstacle there, whatever the posture; or where the arm has as many joints as rows, so that
one branch of postures leads along the path, and that branch leads out of a limit.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.constraints import CollisionConstraint
from dikbench.problem.embedding import embedding_of
from dikbench.problem.tasks import PoseTask, PositionTask
from dikbench.robots.collision.bodies import collision_bodies
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import JointLimits
from dikbench.scenario.reach_bound import ALLOWED_OUTSIDE, is_out_of_reach
from dikbench.scenario.scenario import Scenario

PASSED_SHARE: Final = 0.9
"""Share of the path that a motion must cover at least."""

ALLOWED_INSIDE_M: Final = 1e-3
"""A distance may fall short of its margin by this (see `dikbench.metrics.outcome`)."""

FIRST_ORDER_FACTOR: Final = 2.0
"""What the tolerance can mend to first order is taken this many times."""

LARGEST_PROBE_RAD: Final = 0.5
"""Where the tolerance allows larger joint displacements, the first order proves nothing."""

BRANCH_SAMPLES: Final = 25
"""Number of samples of the branch that are looked at for singularities."""


ROUNDING_M: Final = 1e-9
"""A distance that is smaller by this only is no smaller."""

TINY: Final = 1e-12
"""Keeps a division from failing."""


def infeasible_because(scenario: Scenario) -> str:
    """Say why nothing can do a scenario, in words; empty where that is not proven."""
    times = _times(scenario)
    beyond = _beyond_the_reach(scenario, times)
    if beyond or scenario.motion is None or scenario.judged == "end":
        return beyond
    return _rigid_clearance(scenario, times[-1]) or _branch_leads_out(scenario, times[-1])


def _times(scenario: Scenario) -> Array:
    """Return nominal times [s] of placements within the tolerance of which a motion must come."""
    path = scenario.embedded_path
    if path is None or scenario.judged == "end":
        return np.array([scenario.reference.duration])
    last = int(np.searchsorted(path.arcs, PASSED_SHARE * path.arcs[-1]))
    chosen: Array = np.linspace(0.0, path.times[max(last - 1, 0)], 101)
    return chosen


def _asks_for_the_whole_pose(scenario: Scenario) -> bool:
    start, length = scenario.reference.placement(0.0).rotation, scenario.characteristic_length
    pose = embedding_of(PoseTask(), scenario.robot, start, length)
    asked = scenario.embedding
    parts = ((pose.linear, asked.linear), (pose.left, asked.left), (pose.right, asked.right))
    if asked.by_error:
        return False
    return pose.scale == asked.scale and all(np.array_equal(a, b) for a, b in parts)


def _beyond_the_reach(scenario: Scenario, times: Array) -> str:
    """Prove that no posture reaches the farthest target, or the one of the deepest excess."""
    robot, reference = scenario.robot, scenario.reference
    whole_pose = _asks_for_the_whole_pose(scenario)
    if not whole_pose and not isinstance(scenario.tracking, PositionTask):
        return ""
    reach = np.linalg.norm(reference.placements(times)[1] - robot.shoulder, axis=1)
    tried = [float(times[int(np.argmax(reach))])]
    if scenario.motion is not None:
        within = scenario.motion.instants <= times[-1]
        margin = np.where(within, scenario.motion.margin, np.inf)
        deepest = int(margin.argmin())
        tried = [float(scenario.motion.instants[deepest])] if margin[deepest] < 0 else []
    for tau in tried:
        target = reference.placement(tau)
        tolerance, length = scenario.tolerance_m, scenario.characteristic_length
        if is_out_of_reach(robot, target, tolerance, whole_pose=whole_pose, length=length):
            return (
                f"no posture inside the position limits comes within {tolerance:g} m of "
                f"the target at {tau:.3g} s, by bounds along the chain"
            )
    return ""


def _rigid_clearance(scenario: Scenario, last: float) -> str:
    """Prove that what the task frame's joint carries cannot keep clear, by the exact motion."""
    robot, motion, deepest = scenario.robot, scenario.motion, (np.inf, 0.0, 0.0)
    if motion is None or not _asks_for_the_whole_pose(scenario):
        return ""
    joint, kinematics = robot.model.frames[robot.frame_id].parentJoint, Kinematics(robot)
    for constraint in scenario.constraints:
        if not isinstance(constraint, CollisionConstraint):
            continue
        pairs = constraint.pairs(robot)
        rigid = np.array([{joint} <= {*carriers} <= {joint, 0} for carriers in pairs.joints])
        if not rigid.any():
            continue
        for tau, q in zip(motion.instants, motion.q, strict=True):
            kinematics.update(q)
            distance = float(pairs.distances(kinematics)[rigid].min())
            if tau <= last and distance - constraint.margin < deepest[0] - deepest[1] - ROUNDING_M:
                deepest = (distance, constraint.margin, float(tau))
    distance, margin, tau = deepest
    if distance >= margin - ALLOWED_INSIDE_M:
        return ""
    lever = _size_of_what_is_carried(scenario) / scenario.characteristic_length
    mended = scenario.tolerance_m * float(np.hypot(1.0, lever))
    if distance + mended < margin - ALLOWED_INSIDE_M:
        return (
            f"at {tau:.3g} s the distance of what the task frame's joint carries is "
            f"{distance:.3g} m instead of {margin:g} m, whatever the posture"
        )
    return ""


def _size_of_what_is_carried(scenario: Scenario) -> float:
    """Bound the distance [m] from the task frame of any point that its joint carries."""
    frame, size = scenario.robot.model.frames[scenario.robot.frame_id], 0.0
    for body in collision_bodies(scenario.robot).geometryObjects:
        if body.parentJoint == frame.parentJoint:
            body.geometry.computeLocalAABB()
            centre = body.placement.act(body.geometry.aabb_center)
            away = float(np.linalg.norm(centre - frame.placement.translation))
            size = max(size, away + body.geometry.aabb_radius)
    return size


def _branch_leads_out(scenario: Scenario, last: float) -> str:
    """Prove that the only motion from the start leads farther out than the tolerance can mend.

    To first order a point x that is off by at most the tolerance moves joint j by at most the
    tolerance times the norm of row j of the inverse of dx/dq. Up to there the branch must be
    regular: the determinant of the Jacobian keeps its sign on it and as far aside as that.
    """
    robot, motion, limits = scenario.robot, scenario.motion, scenario.robot.limits
    chain, rows = robot.chain, scenario.rows
    if motion is None or len(chain) != len(rows) or motion.margin[0] < 0:
        return ""
    embedding = scenario.embedding
    if embedding.of_one_turn or embedding.by_error:  # points that are not linear in the rotation
        return ""
    kinematics, worst = Kinematics(robot), (1.0, "", 0)
    unit = FIRST_ORDER_FACTOR * scenario.tolerance_m
    for k in range(int(np.searchsorted(motion.instants, last, side="right"))):
        kinematics.update(motion.q[k])
        over = _over(limits, motion.q[k])[chain]
        short, gradient = _short_of_distances(scenario, kinematics)
        if over.max() <= 0 and short <= 0:
            continue
        back = np.linalg.pinv(_tangents(scenario, kinematics))
        shares = over / (unit * np.linalg.norm(back, axis=1))
        j = int(shares.argmax())
        joint = f"joint {j + 1} is {over[j]:.3g} rad outside its limit"
        mended = unit * float(np.linalg.norm(gradient @ back))
        pair = f"two bodies are {short:.3g} m nearer to each other than they may be"
        worst = max(worst, (float(shares[j]), joint, k), (short / max(mended, TINY), pair, k))
    share, words, k = worst
    if share <= 1 or not _is_regular(scenario, motion.q[: k + 1]):
        return ""
    return (
        f"the arm has as many joints as the task has rows, and on the only branch from its start "
        f"{words} at {motion.instants[k]:.3g} s, {FIRST_ORDER_FACTOR * share:.2g} times what the "
        "tolerance can mend"
    )


def _tangents(scenario: Scenario, kinematics: Kinematics) -> Array:
    """Compute dx/dq of the point x of the task frame (see `Embedding`), (d, n) for its n joints."""
    robot = scenario.robot
    R = kinematics.placement(robot.frame_id).rotation
    J = kinematics.jacobian(robot.frame_id)[:, robot.chain]
    turned = np.array([R @ pin.skew(column) for column in J[3:].T])
    return scenario.embedding.points(turned, (R @ J[:3]).T).T


def _over(limits: JointLimits, q: Array) -> Array:
    """Compute how far each joint is outside of where it may be at q (nq,), (nv,)."""
    if limits.position is None:
        return np.full(limits.nv, -np.inf)
    values = q[limits.q_index]
    excess = np.maximum(values - limits.position.upper, limits.position.lower - values)
    return np.where(limits.q_index >= 0, excess - ALLOWED_OUTSIDE, -np.inf)


def _short_of_distances(scenario: Scenario, kinematics: Kinematics) -> tuple[float, Array]:
    """Compute by how much a distance is short of what it may be, and its gradient, (n,)."""
    worst, gradient = -np.inf, np.zeros(len(scenario.robot.chain))
    for constraint in scenario.constraints:
        if isinstance(constraint, CollisionConstraint):
            pairs = constraint.pairs(scenario.robot)
            short = constraint.margin - ALLOWED_INSIDE_M - pairs.distances(kinematics)
            pair = int(short.argmax())
            if short[pair] > worst:
                worst = float(short[pair])
                slopes = pairs.gradients(kinematics, np.array([pair]))
                gradient = slopes[0, scenario.robot.chain]
    # Nothing is said of a pair whose nearest points have no direction from each other.
    return (worst if gradient.any() else -np.inf), gradient


def _is_regular(scenario: Scenario, q: Array) -> bool:
    """Say whether no singularity is on a branch (k, nq), nor as far aside as is allowed."""
    robot, kinematics, signs = scenario.robot, Kinematics(scenario.robot), set()
    rows, chain = scenario.rows, robot.chain
    for number in np.unique(np.linspace(0, len(q) - 1, BRANCH_SAMPLES).astype(int)):
        kinematics.update(q[number])
        _, sizes, directions = np.linalg.svd(_tangents(scenario, kinematics), full_matrices=False)
        lengths = FIRST_ORDER_FACTOR * scenario.tolerance_m / sizes
        if lengths.max() > LARGEST_PROBE_RAD:
            return False
        steps = np.zeros((2 * len(chain) + 1, robot.nv))
        steps[1:, chain] = np.vstack(
            [lengths[:, None] * directions, -lengths[:, None] * directions]
        )
        for step in steps:
            kinematics.update(pin.integrate(robot.model, q[number], step))
            J = kinematics.task_jacobian(rows)[:, chain]
            signs.add(np.sign(np.linalg.det(J)))
    return len(signs) == 1
