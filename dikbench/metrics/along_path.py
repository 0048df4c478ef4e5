"""The course of a motion along its path: its coverage, its lag and the tolerances it needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from dikbench.arrays import Array, Indices
from dikbench.metrics.coverage import Coverage
from dikbench.scenario.reference.embedded_path import SAME_INSTANT_S, EmbeddedPath
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import path_has_ended
from dikbench.simulation.trace import Trace

LAG_ALLOWED_S: Final = 0.1
"""Lag [s] at the end of the reference up to which a motion is in time ..."""

LAG_ALLOWED_SHARE: Final = 0.05
"""... or up to this share of the nominal duration of the reference, where that is more."""

DONE_SHARES: Final = (0.99, 0.90)
"""Shares of the path for which the tolerances are computed at which they are covered."""

ROUNDING: Final = 1e-9
"""Tolerance of comparisons of path lengths [m] and of nominal times [s]."""


@dataclass(frozen=True, eq=False)
class AlongPath:
    """A motion of n control steps along a path that is not a point.

    Attributes:
        path: the path.
        trace: the trace of the motion.
        scenario: the case that it is a trace of.
        points: of the motion, at the start and after each step, (n + 1, d) [m] (see `Embedding`).
        apart: how far other frames of the first priority are from their targets in each segment,
            (n + 1,) [m].
    """

    path: EmbeddedPath
    trace: Trace
    scenario: Scenario
    points: Array
    apart: Array

    @cached_property
    def last_sample(self) -> int:
        """Number of the last sample that a whole run comes to."""
        scenario, by_clock = self.scenario, self.trace.mode == "time"
        end = scenario.steps * scenario.dt if by_clock else scenario.reference.duration
        return int(self.path.last_until(end))

    @cached_property
    def target_samples(self) -> Indices:
        """Number of the last sample that may be covered at each instant, (n + 1,).

        That of the target, or the path's last one where it waits for the robot.
        """
        if self.trace.mode == "path":
            return np.full(self.trace.steps + 1, self.last_sample)
        samples: Indices = np.minimum(self.path.last_until(self.trace.tau), self.last_sample)
        return np.maximum.accumulate(samples)

    @cached_property
    def end_of_reference(self) -> int:
        """Number of the instant at which the reference ends, or the run if that is before."""
        end = self.scenario.reference.duration + 0.5 * self.trace.dt
        return max(int(np.searchsorted(self.trace.tau, end, side="right")) - 1, 0)

    @cached_property
    def coverage(self) -> Coverage:
        """How the path is covered in its order, for every tolerance."""
        at_target = np.searchsorted(self.trace.tau, self.path.times - SAME_INSTANT_S)
        at_target = np.minimum(at_target, self.trace.steps)
        return Coverage(self.path, self.points, self.target_samples, at_target, self.apart)

    @cached_property
    def covered_at(self) -> Indices:
        """The instants at which samples are covered at the scenario's own tolerance."""
        return self.coverage.instants(self.scenario.tolerance_m)

    @cached_property
    def done(self) -> float:
        """Share of the path that is covered at the end, at the scenario's own tolerance."""
        if self._needed[2] <= self.scenario.tolerance_m:
            return 1.0
        arcs = self.path.arcs
        return float(arcs[max(len(self.covered_at) - 1, 0)] / arcs[self.last_sample])

    @cached_property
    def lag(self) -> Array:
        """Delay on the path until the reference ends, (k + 1,) [s].

        The nominal time from the last sample covered, at the scenario's own tolerance, to the
        target. Empty where that waits for the robot.
        """
        if self.trace.mode == "path":
            return np.empty(0)
        instants, times = np.arange(self.end_of_reference + 1), self.path.times
        covered = np.searchsorted(self.covered_at, instants, side="right") - 1
        late: Array = times[self.target_samples[instants]] - times[np.maximum(covered, 0)]
        return late

    @property
    def tolerances(self) -> tuple[float, float, float]:
        """The smallest tolerances [m] at which 99 % and 90 % are covered at the end, and in time.

        In time is who is late by at most 0.1 s at the end of the reference, or 5 % of its nominal
        duration where that is more; NaN where it waits for the robot. Infinite above 0.25 m, and,
        of 99 %, where a path that waits was not brought to its end.
        """
        done_99, done_90, _, in_time = self._needed
        if self.trace.mode == "path" and not path_has_ended(
            self.trace.tau[-1], self.path.times[-1]
        ):
            done_99 = float("inf")  # it stopped short of the end, and the path waits for ever
        return done_99, done_90, in_time

    @cached_property
    def _needed(self) -> tuple[float, float, float, float]:
        """The tolerances at which 99 %, 90 % and all are covered at the end, and in time [m]."""
        by_clock, end, arcs = self.trace.mode == "time", self.end_of_reference, self.path.arcs
        wanted = [share * arcs[self.last_sample] - ROUNDING for share in DONE_SHARES]
        samples = [*np.searchsorted(arcs, wanted).tolist(), self.last_sample]
        asked = [(sample, self.trace.steps) for sample in samples]
        allowed = max(LAG_ALLOWED_S, LAG_ALLOWED_SHARE * self.scenario.reference.duration)
        latest = self.path.times[self.target_samples[end]] - allowed - ROUNDING
        sample = int(np.searchsorted(self.path.times, latest))
        # Before anything is covered a motion counts as being at the start.
        is_open = by_clock and sample > 0
        found = self.coverage.needed([*asked, (sample, end)] if is_open else asked)
        in_time = found[3] if is_open else 0.0 if by_clock else float("nan")
        return found[0], found[1], found[2], in_time
