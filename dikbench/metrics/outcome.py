"""The outcome of a trial: whether the robot did its job, and if not, what was first in the way."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final

from dikbench.scenario.witness import Feasible

NAN: Final = float("nan")

RECOVERY_TOLERANCES: Final = 10
"""Who recovers may be off the path, or leave out of it, by so many tolerances ..."""

RECOVERY_SHARE: Final = 0.25
"""... and by at most this share of the path's extent."""

DONE_BY_CLOCK_SHARE: Final = 0.90
"""Share of a path that must be done where the reference moves with the clock."""

DONE_SHARE: Final = 0.99
"""Share of it that must be done where the reference waits, and by who recovers."""


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


OUTCOME_SENTENCES: Final[Mapping[Outcome, str]] = MappingProxyType(
    {
        Outcome.DID_NOT_RUN: "the run broke off: an error, a crash, no time or memory left",
        Outcome.DIVERGED: "the motion left all bounds",
        Outcome.COLLIDED: "a distance fell more than 1 mm below its margin",
        Outcome.LIMIT_BROKEN: "a joint passed a limit: 1.001 of its speed or torque, 1.01 of its "
        "acceleration, 1e-3 rad or m of its range",
        Outcome.LEFT_PATH: "farther from the path, or from where it is to stay, than the tolerance",
        Outcome.UNFINISHED: "less than 99 % of the path done where it waits, less than 90 % by the "
        "clock, or not at the target in the end",
        Outcome.LATE: "behind the clock by more than 0.1 s and 5 % of the nominal duration",
        Outcome.NOT_RECOVERED: "where nothing can follow the clock: not back at the end, or away "
        "by more than 10 tolerances or a quarter of the path's extent",
        Outcome.CHATTERING: "a joint's velocity jumps back within 2 steps, or shakes at 10 Hz or "
        "more by over 1 % of its limit, in more than 5 % of the steps",
        Outcome.SUCCESS: "the robot did its job",
        Outcome.RECOVERED: "nothing can follow the clock here; the robot gave way and came back",
    }
)
"""What the outcomes say, each but the last two being what came first in the way."""


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
        holds: whether the robot is where it is to stay from the start on.
    """

    before: Verdict | None
    by_clock: bool
    has_path: bool
    feasible: Feasible
    off_path: Verdict = Verdict(Outcome.LEFT_PATH)
    end: Verdict = Verdict(Outcome.UNFINISHED)
    done_99: float = NAN
    done_90: float = NAN
    in_time: float = NAN
    extent: float = 0.0
    chatter: Verdict | None = None
    holds: bool = False

    def at(self, tolerance: float) -> Verdict:
        """Decide the outcome at a tolerance [m]."""
        gives_way = self.has_path and self.by_clock and self.feasible == "path"
        reasons = self._not_recovered(tolerance) if gives_way else self._not_done(tolerance)
        found = self.before or next(reasons, None) or self.chatter
        return found or Verdict(Outcome.RECOVERED if gives_way else Outcome.SUCCESS)

    def _not_done(self, tolerance: float) -> Iterator[Verdict]:
        """What keeps the task from being done."""
        if not self.has_path:
            if self.holds and not self.off_path.figure <= tolerance:
                yield self.off_path
            if not self.end.figure <= tolerance:  # NaN is no success
                yield Verdict(Outcome.UNFINISHED, self.end.step, self.end.figure, self.end.reason)
            return
        if not self.off_path.figure <= tolerance:
            yield self.off_path
        share, needed = DONE_SHARE, self.done_99
        if self.by_clock:
            share, needed = DONE_BY_CLOCK_SHARE, self.done_90
        if not needed <= tolerance:
            reason = f"tolerance [m] at which {share:.0%} of the path are done"
            yield Verdict(Outcome.UNFINISHED, self.end.step, needed, reason)
        if self.by_clock and not self.in_time <= tolerance:
            reason = "tolerance [m] at which it is in time"
            yield Verdict(Outcome.LATE, self.end.step, self.in_time, reason)

    def _not_recovered(self, tolerance: float) -> Iterator[Verdict]:
        """What keeps a robot from having given way and come back, where nothing could follow."""
        bound = self.recovery_bound(tolerance)
        cut = "tolerance [m] at which 99% of the path are done"
        for step, figure, most, reason in (
            (self.end.step, self.end.figure, tolerance, self.end.reason),
            (self.end.step, self.done_99, bound, cut),
            (self.off_path.step, self.off_path.figure, bound, self.off_path.reason),
        ):
            if not figure <= most:
                yield Verdict(Outcome.NOT_RECOVERED, step, figure, reason)

    def recovery_bound(self, tolerance: float) -> float:
        """Return how far [m] who recovers may be off the path, and the cut, at a tolerance [m]."""
        return min(RECOVERY_TOLERANCES * tolerance, RECOVERY_SHARE * self.extent)

    def columns(self, tolerance: float) -> dict[str, Any]:
        """Return what a row of results keeps: the outcome at a tolerance [m], and all of `at`."""
        verdict = self.at(tolerance)
        return {
            "outcome": verdict.outcome.value,
            "outcome_step": verdict.step,
            "outcome_figure": verdict.figure,
            "outcome_reason": verdict.reason,
            "decided_before": "" if self.before is None else self.before.outcome.value,
            "chatters": float(self.chatter is not None),
            "judged_by_path": float(self.has_path),
            "holds": float(self.holds),
            "off_path_by": self.off_path.reason,
            "path_extent_m": self.extent,
            "tolerance_m": tolerance,
            "feasible": self.feasible,
        }

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> Judgement:
        """Make the judgement of a row of results, without the steps that decided."""
        before, chatters = row["decided_before"], bool(row["chatters"])
        return cls(
            before=Verdict(Outcome(before)) if isinstance(before, str) and before else None,
            by_clock=row["reference"] == "time",
            has_path=bool(row["judged_by_path"]),
            feasible=row["feasible"],
            off_path=Verdict(Outcome.LEFT_PATH, -1, row["contour_error_6d_max_m"]),
            end=Verdict(Outcome.UNFINISHED, -1, row["tracking_error_6d_final_m"]),
            done_99=row["path_done_99_tolerance_m"],
            done_90=row["path_done_90_tolerance_m"],
            in_time=row["lag_tolerance_m"],
            extent=row["path_extent_m"],
            chatter=Verdict(Outcome.CHATTERING) if chatters else None,
            holds=row["holds"] == 1,
        )


OUTCOME_TEXTS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "outcome": "whether the robot did its job, and if not, what was first in the way",
        "outcome_reason": "what `outcome_figure` is of",
        "decided_before": "outcome that was decided before any tolerance; empty where none was",
        "off_path_by": "whether the largest distance from the path is by position or orientation",
        "feasible": "what a motion is known for that keeps all limits: time, path, no or unknown",
        "situation": "what is difficult about the scenario",
        "robot": "name of the robot",
    }
)
"""Columns of outcomes that are texts, and what they say."""

OUTCOME_NUMBERS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "outcome_step": ("", "step that decided the outcome; -1 where none did"),
        "outcome_figure": ("", "value that decided it, in what `outcome_reason` says"),
        "chatters": ("", "whether it chatters, which decides after any tolerance (1, 0)"),
        "judged_by_path": ("", "whether the whole path is judged, or the end alone (1, 0)"),
        "holds": ("", "whether the robot is at the start where it is to stay (1, 0)"),
        "path_extent_m": ("m", "largest distance of the path from its start (L = 0.2 m)"),
        "tolerance_m": ("m", "tolerance of the scenario, at which `outcome` is decided"),
        "coped": ("", "where nothing can follow: whether limits were kept, the path done as far as "
                  "can be, and its end reached where it can be (1, 0)"),
        "followable_until_s": ("s", "nominal time of the exact motion's first break of a position "
                               "limit or a distance; empty where it keeps all"),
        "speed_need": ("", "largest joint speed of the exact motion over its limit"),
    }
)  # fmt: skip
"""Columns of outcomes that are numbers: unit, and what they say."""
