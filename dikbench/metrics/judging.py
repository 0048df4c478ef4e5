"""The judgement of a motion, which decides the outcome of its trial at every tolerance."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from dikbench.metrics.chatter import chattering
from dikbench.metrics.motion import Motion
from dikbench.metrics.outcome import Judgement, Outcome, Verdict
from dikbench.scenario.violation import POSITION_TOLERANCE, SPEED_TOLERANCE, broken_limit, collision
from dikbench.scenario.witness import INSIDE_SHARE
from dikbench.simulation.status import Status

CHATTER_SHARE: Final = 0.05
"""A motion chatters that does so in more than this share of its steps ..."""

CHATTER_STEPS: Final = 10
"""... and in at least so many of them."""

COPED_SHARE: Final = 0.9
"""Share that must be done of the part of a path that can be followed."""


def judge(motion: Motion, status: Status) -> Judgement:
    """Judge a motion of at least one step.

    Args:
        motion: the motion.
        status: how the run ended.
    """
    scenario, before = motion.scenario, _before_any_tolerance(motion, status)
    decided = Judgement(
        before, motion.trace.mode == "time", scenario.judged == "path", scenario.feasible
    )
    if before is not None and before.outcome in (Outcome.DID_NOT_RUN, Outcome.DIVERGED):
        return decided
    along, last = motion.along_path, motion.trace.steps
    away = float(motion.tracking_error[last])
    decided = replace(
        decided,
        has_path=decided.has_path and along is not None,
        off_path=_off_path(motion),
        end=Verdict(Outcome.UNFINISHED, last, away, "distance [m] from the target at the end"),
        chatter=_chatter(motion),
        holds=_holds(motion),
    )
    if along is None:
        return decided
    done_99, done_90, in_time = along.tolerances
    extent = along.path.extent
    return replace(decided, done_99=done_99, done_90=done_90, in_time=in_time, extent=extent)


def _holds(motion: Motion) -> bool:
    """Say whether the robot is at the start where it is to stay, so that it must not leave."""
    scenario, targets = motion.scenario, motion.target_points
    if scenario.reference.moving or scenario.judged == "end":
        return False
    away = float(np.linalg.norm(targets - targets[0], axis=1).max())
    return max(float(motion.tracking_error[0]), away) <= scenario.tolerance_m


def coped(motion: Motion, judgement: Judgement) -> float:
    """Say whether a motion did what can be done of a path that nothing can follow, 1 or 0.

    It kept every limit, did 0.9 of the path before the exact motion's first break, and is at the
    target in the end where that comes back. NaN where the question does not arise.
    """
    scenario, along = motion.scenario, motion.along_path
    until, tolerance = scenario.followable_until, scenario.tolerance_m
    if scenario.feasible != "no" or until is None or along is None:
        return float("nan")
    arcs = along.path.arcs
    length = float(arcs[along.path.last_until(until)])
    if length < 2 * tolerance:
        return float("nan")
    done = float(arcs[max(len(along.covered_at) - 1, 0)]) >= COPED_SHARE * length
    back = not scenario.comes_back or judgement.end.figure <= tolerance
    return float(judgement.before is None and done and back)


def outcome_columns(motion: Motion, status: Status) -> dict[str, Any]:
    """Judge a motion of at least one step, and return the columns of its outcome."""
    scenario, judgement = motion.scenario, judge(motion, status)
    return {
        **judgement.columns(scenario.tolerance_m),
        "coped": coped(motion, judgement),
        "situation": scenario.situation,
        "robot": scenario.robot.name,
        "speed_need": scenario.need,
        "followable_until_s": scenario.followable_until,
    }


def _before_any_tolerance(motion: Motion, status: Status) -> Verdict | None:
    """What is decided whatever the tolerance: a run that broke off, a collision, a limit."""
    last = motion.trace.steps
    if status is Status.DIVERGED:
        return Verdict(Outcome.DIVERGED, last)
    if status not in (Status.OK, Status.PROTECTIVE_STOP):
        return Verdict(Outcome.DID_NOT_RUN, last, reason=status.value)
    scenario, trace = motion.scenario, motion.trace
    if not (_may_have_broken_a_limit(motion) or len(motion.clearance)):
        return None
    late = trace.dt * np.arange(trace.steps + 1) >= INSIDE_SHARE * scenario.reference.duration
    found = collision(motion.clearance) or broken_limit(
        scenario.robot, trace.q, late, trace.applied, motion.accelerations, motion.torque_usage
    )
    return found and Verdict(Outcome(found.kind), found.step, found.figure, found.reason)


def _may_have_broken_a_limit(motion: Motion) -> bool:
    """Say whether a joint is past a limit at all, of how far it may be in `broken_limit`."""
    return (
        bool((motion.velocity_usage > SPEED_TOLERANCE).any())
        or bool((motion.position_excess > POSITION_TOLERANCE).any())
        or bool((motion.acceleration_excess > 0).any())
        or bool((motion.torque_usage > 1).any())
    )


def _off_path(motion: Motion) -> Verdict:
    """Say where the motion is farthest from its path, and whether by position or orientation."""
    step = int(motion.contour_error_6d.argmax())
    figure = float(motion.contour_error_6d[step])
    path, linear = motion.scenario.embedded_path, len(motion.scenario.embedding.linear)
    if path is None:
        return Verdict(Outcome.LEFT_PATH, step, figure, "position")
    _, pieces, shares = motion.nearest_on_path
    foot = path.points[pieces[step]] + shares[step] * path.pieces[pieces[step]]
    away = motion.points[step] - foot
    by_position = np.linalg.norm(away[:linear]) >= np.linalg.norm(away[linear:])
    return Verdict(Outcome.LEFT_PATH, step, figure, "position" if by_position else "orientation")


def _chatter(motion: Motion) -> Verdict | None:
    """What is decided after any tolerance."""
    mask = motion.series(chattering)
    count = int(np.count_nonzero(mask))
    if count < CHATTER_STEPS or count <= CHATTER_SHARE * len(mask):
        return None
    return Verdict(
        Outcome.CHATTERING, int(mask.argmax()), count / len(mask), "share of the steps that chatter"
    )
