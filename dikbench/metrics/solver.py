"""Whether the law had an answer, and whether the solver's answers are right."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from dikbench.arrays import Array, Mask
from dikbench.metrics.metric import INF, Metric, largest, mean
from dikbench.metrics.motion import Motion
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace

FELL_BACK = (Status.INFEASIBLE, Status.SOLVER_FAILED)
"""Steps at which the law had no answer and the fallback was applied."""


def _are(trace: Trace, *statuses: Status) -> Mask:
    """Which steps have one of these statuses, (n,)."""
    return np.isin(trace.status, [STEP_CODE[status] for status in statuses])


def _share(status: Status) -> Callable[[Motion], float]:
    return lambda motion: motion.trace.share(status)


def _share_of(steps: Mask, motion: Motion) -> float:
    """The share of the steps at which something was solved; NaN where nothing ever was."""
    return mean(steps[motion.trace.claimed >= 0])


def _largest_of(residuals: Array, motion: Motion) -> float:
    """The largest at steps at which something was solved; NaN where none is known."""
    return largest(residuals[motion.trace.claimed >= 0])


SOLVER = (
    Metric(
        "feasible_share", "", "high", 0.0, "limit violation",
        "share of the steps whose answer was the law's own, and held by the recheck",
        lambda m: mean(~_are(m.trace, *FELL_BACK, Status.NOT_VERIFIED)),
    ),
    Metric(
        "infeasible_share", "", "low", 1.0, "limit violation",
        "share of the steps whose program had no feasible point",
        _share(Status.INFEASIBLE),
    ),
    Metric(
        "solver_failed_share", "", "low", 1.0, "solver",
        "share of the steps at which the solver gave no answer to a feasible program",
        _share(Status.SOLVER_FAILED),
    ),
    Metric(
        "not_verified_share", "", "low", 1.0, "solver",
        "share of the steps whose answer, claimed solved, failed the recheck",
        _share(Status.NOT_VERIFIED),
    ),
    Metric(
        "fallback_steps", "", "low", INF, "limit violation",
        "number of steps without an answer, at which the robot was slowed down instead",
        lambda m: float(np.count_nonzero(_are(m.trace, *FELL_BACK))),
    ),
    Metric(
        "relaxed_share", "", "low", 1.0, "limit violation",
        "share of the steps at which an acceleration bound was given up",
        lambda m: mean(m.trace.relaxed > 0),
    ),
    Metric(
        "relaxed_steps", "", "low", INF, "limit violation",
        "number of steps at which an acceleration bound was given up",
        lambda m: float(np.count_nonzero(m.trace.relaxed)),
    ),
    Metric(
        "claimed_share", "", "high", 0.0, "solver",
        "share of the steps with programs of which the solver said that it solved them all",
        lambda m: _share_of(m.trace.claimed == 1, m),
    ),
    Metric(
        "verified_share", "", "high", 0.0, "solver",
        "share of the steps with programs whose answers are all right by our own residuals",
        lambda m: _share_of(m.trace.verified == 1, m),
    ),
    Metric(
        "disagreed_share", "", "low", 1.0, "solver",
        "share of the steps with programs at which claim and recheck disagree",
        lambda m: _share_of(m.trace.claimed != m.trace.verified, m),
    ),
    Metric(
        "optimum_distance_max_rad_s", "rad/s", "low", INF, "solver",
        "largest distance of a solver's answer from the optimum (alpha scaling: in alpha)",
        lambda m: largest(m.trace.distance),
    ),
    Metric(
        "primal_residual_max_rad_s", "rad/s", "low", INF, "solver",
        "largest violation of a program's own constraints by an answer, recomputed",
        lambda m: _largest_of(m.trace.primal, m),
    ),
    Metric(
        "dual_residual_max", "", "low", INF, "solver",
        "largest residual of a program's stationarity, recomputed; NaN without multipliers",
        lambda m: _largest_of(m.trace.dual, m),
    ),
    Metric(
        "gap_max", "", "low", INF, "solver",
        "largest duality gap of an answer, recomputed; NaN without multipliers",
        lambda m: _largest_of(m.trace.gap, m),
    ),
)  # fmt: skip
