"""The outcome of a trial: whether the robot did its job, and if not, what came first in the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.metrics.chatter import chattering
from dikbench.metrics.motion import Motion
from dikbench.scenario.witness import INSIDE_SHARE, Feasible, outside
from dikbench.simulation.status import Status

COLLISION_TOLERANCE_M: Final = 1e-3
"""A distance may fall short of its margin by this."""

SPEED_TOLERANCE: Final = 1.001
"""Joint speeds may be this many times their limit."""

ACCELERATION_TOLERANCE: Final = 1.01
"""Joint accelerations may be this many times theirs."""

TORQUE_TOLERANCE: Final = 1.001
"""Joint torques may be this many times theirs."""

POSITION_TOLERANCE: Final = 1e-3
"""A joint may be so far outside its position limits [rad or m]."""

CHATTER_SHARE: Final = 0.05
"""A motion chatters that does so in more than this share of its steps ..."""

CHATTER_STEPS: Final = 10
"""... and in at least so many of them."""

RECOVERY_TOLERANCES: Final = 10
"""Who recovers may be off the path, or leave out of it, by so many tolerances ..."""

RECOVERY_SHARE: Final = 0.25
"""... and by at most this share of the path's extent."""


class Outcome(StrEnum):
    """The outcomes of a trial, in the order in which they are asked for; the first one counts."""

    DID_NOT_RUN = "did-not-run"
    DIVERGED = "diverged"
    COLLIDED = "collided"
    LIMIT_BROKEN = "limit-broken"
    LEFT_PATH = "left-path"
    UNFINISHED = "unfinished"
    LATE = "late"
    NOT_RECOVERED = "not-recovered"
    CHATTERING = "chattering"
    SUCCESS = "success"
    RECOVERED = "recovered"


@dataclass(frozen=True)
class Verdict:
    """An outcome and what decided it.

    Attributes:
        outcome: the outcome.
        step: number of the step or instant that decided; -1 where none did.
        figure: the value that decided; NaN where none did.
        reason: what the figure is of; empty where there is none.
    """

    outcome: Outcome
    step: int = -1
    figure: float = float("nan")
    reason: str = ""


@dataclass(frozen=True)
class Judgement:
    """What decides the outcome of a trial at every tolerance, without its trace.

    Attributes:
        before: what was decided before any tolerance; None where nothing was.
        by_clock: whether the reference moved with the clock.
        has_path: whether it has a path that is judged, and not the end alone.
        feasible: what a motion is known for (see `Feasible`).
        off_path: of the largest distance from the path: instant, distance [m], and whether it is by
            `position` or by `orientation`.
        end: the last instant, and the distance from the target there [m].
        done_99, done_90, in_time: smallest tolerances at which 99 % and 90 % of the path are done
            and at which the motion is in time [m] (see `AlongPath.tolerances`).
        extent: largest distance of the path from its start [m].
        chatter: what comes after any tolerance; None where nothing does.
    """

    before: Verdict | None
    by_clock: bool
    has_path: bool
    feasible: Feasible
    off_path: Verdict
    end: Verdict
    done_99: float
    done_90: float
    in_time: float
    extent: float
    chatter: Verdict | None

    def at(self, tolerance: float) -> Verdict:
        """Decide the outcome at a tolerance [m]."""
        gives_way = self.has_path and self.by_clock and self.feasible == "path"
        reasons = self._not_recovered(tolerance) if gives_way else self._not_done(tolerance)
        found = self.before or next(reasons, None) or self.chatter
        return found or Verdict(Outcome.RECOVERED if gives_way else Outcome.SUCCESS)

    def _not_done(self, tolerance: float) -> Iterator[Verdict]:
        """What keeps the task from being done."""
        if not self.has_path:
            if self.end.figure > tolerance:
                yield Verdict(Outcome.UNFINISHED, self.end.step, self.end.figure, self.end.reason)
            return
        if self.off_path.figure > tolerance:
            yield self.off_path
        share, needed = (0.90, self.done_90) if self.by_clock else (0.99, self.done_99)
        if needed > tolerance:
            reason = f"tolerance [m] at which {share:.0%} of the path are done"
            yield Verdict(Outcome.UNFINISHED, self.end.step, needed, reason)
        if self.by_clock and self.in_time > tolerance:
            reason = "tolerance [m] at which it is in time"
            yield Verdict(Outcome.LATE, self.end.step, self.in_time, reason)

    def _not_recovered(self, tolerance: float) -> Iterator[Verdict]:
        """What keeps a robot from having given way and come back, where nothing could follow."""
        bound = min(RECOVERY_TOLERANCES * tolerance, RECOVERY_SHARE * self.extent)
        cut = "tolerance [m] at which 99% of the path are done"
        for step, figure, most, reason in (
            (self.end.step, self.end.figure, tolerance, self.end.reason),
            (self.end.step, self.done_99, bound, cut),
            (self.off_path.step, self.off_path.figure, bound, self.off_path.reason),
        ):
            if figure > most:
                yield Verdict(Outcome.NOT_RECOVERED, step, figure, reason)


def judge(motion: Motion, status: Status, feasible: Feasible = "time") -> Judgement:
    """Judge a motion of at least one step.

    Args:
        motion: the motion.
        status: how the run ended.
        feasible: what a motion is known for in its scenario.
    """
    scenario, along = motion.scenario, motion.along_path
    has_path = along is not None and scenario.judged == "path"
    nan = float("nan")
    done_99, done_90, in_time = along.tolerances if along is not None else (nan, nan, nan)
    extent = 0.0
    if along is not None:
        extent = float(np.linalg.norm(along.path.points - along.path.points[0], axis=1).max())
    last = motion.trace.steps
    away = float(motion.tracking_error[last])
    return Judgement(
        before=_before_any_tolerance(motion, status),
        by_clock=motion.trace.mode == "time",
        has_path=has_path,
        feasible=feasible,
        off_path=_off_path(motion),
        end=Verdict(Outcome.UNFINISHED, last, away, "distance [m] from the target at the end"),
        done_99=done_99,
        done_90=done_90,
        in_time=in_time,
        extent=extent,
        chatter=_chatter(motion),
    )


def _before_any_tolerance(motion: Motion, status: Status) -> Verdict | None:
    """What is decided whatever the tolerance: a run that broke off, a collision, a limit."""
    last = motion.trace.steps
    if status is Status.DIVERGED:
        return Verdict(Outcome.DIVERGED, last)
    if status is not Status.OK:
        return Verdict(Outcome.DID_NOT_RUN, last, reason=status.value)
    hit = motion.clearance < -COLLISION_TOLERANCE_M
    if hit.any():
        return _first(Outcome.COLLIDED, hit, -motion.clearance, "distance [m] below its margin")
    broken = [
        _first(Outcome.LIMIT_BROKEN, values > most, values, reason)
        for values, most, reason in _shares_of_limits(motion)
        if (values > most).any()
    ]
    trace, reference = motion.trace, motion.scenario.reference
    late = trace.dt * np.arange(trace.steps + 1) >= INSIDE_SHARE * reference.duration
    outside_by = outside(motion.scenario.robot, trace.q, late, POSITION_TOLERANCE)
    if (outside_by > 0).any():
        reason = "distance [rad or m] of a joint outside what it may be"
        broken.append(_first(Outcome.LIMIT_BROKEN, outside_by > 0, outside_by, reason))
    return min(broken, key=lambda verdict: verdict.step) if broken else None


def _shares_of_limits(motion: Motion) -> list[tuple[Array, float, str]]:
    """Return speed, acceleration and torque over their limits in each step, (n,); and the most."""
    limits, v = motion.scenario.robot.limits, motion.trace.applied
    shares = []
    if limits.velocity is not None:
        usage = limits.velocity.usage(v).max(axis=1, initial=0.0)
        shares.append((usage, SPEED_TOLERANCE, "joint speed over its limit"))
    if limits.acceleration is not None:
        usage = limits.acceleration.usage(motion.accelerations).max(axis=1, initial=0.0)
        shares.append((usage, ACCELERATION_TOLERANCE, "joint acceleration over its limit"))
    if len(motion.torque_usage):
        shares.append((motion.torque_usage, TORQUE_TOLERANCE, "joint torque over its limit"))
    return shares


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
    mask = chattering(motion)
    count = int(np.count_nonzero(mask))
    if count < CHATTER_STEPS or count <= CHATTER_SHARE * len(mask):
        return None
    return Verdict(
        Outcome.CHATTERING, int(mask.argmax()), count / len(mask), "share of the steps that chatter"
    )


def _first(outcome: Outcome, mask: Mask, values: Array, reason: str) -> Verdict:
    """Decide by the first step of a mask."""
    step = int(mask.argmax())
    return Verdict(outcome, step, float(values[step]), reason)
