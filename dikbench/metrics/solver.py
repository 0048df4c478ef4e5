"""Whether the formulation had answers, and whether the solver's answers are correct."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import or_

from dikbench.arrays import Array, Mask
from dikbench.metrics.metric import Metric, series_metrics
from dikbench.metrics.motion import Motion
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.simulation.trace import Trace

FALLBACK_STATUSES = (Status.INFEASIBLE, Status.SOLVER_FAILED)
"""Statuses of steps without an answer, at which the fallback was applied."""


def _has_status(motion: Motion, *statuses: Status) -> Mask:
    """Return which steps have one of these statuses, (n,)."""
    codes = motion.trace.status
    return reduce(or_, [codes == STEP_CODE[status] for status in statuses])


def _share(name: str, status: Status, definition: str) -> tuple[Metric, ...]:
    """Make the metric of how often the steps of a run have a status."""
    code = STEP_CODE[status]
    return series_metrics(name, "", definition, lambda m: m.trace.status == code, "share")


def _solved(values: Callable[[Trace], Array | Mask]) -> Callable[[Motion], Array | Mask]:
    """Restrict values to the steps at which something was solved."""
    return lambda motion: values(motion.trace)[motion.trace.claimed >= 0]


SOLVER = (
    *series_metrics(
        "feasible", "", "whose answer was the formulation's own, and held by the recheck",
        lambda m: ~_has_status(m, *FALLBACK_STATUSES, Status.NOT_VERIFIED), "share", best="high",
    ),
    *_share("infeasible", Status.INFEASIBLE, "whose program had no feasible point"),
    *_share(
        "solver_failed", Status.SOLVER_FAILED,
        "at which the solver gave no answer to a feasible program",
    ),
    *_share(
        "not_verified", Status.NOT_VERIFIED, "whose answer, claimed solved, failed the recheck"
    ),
    *series_metrics(
        "fallback", "", "without an answer, at which the robot was slowed down instead",
        lambda m: _has_status(m, *FALLBACK_STATUSES), "steps",
    ),
    *series_metrics(
        "relaxed", "", "at which an acceleration bound was given up",
        lambda m: m.trace.relaxed > 0, "share", "steps",
    ),
    *series_metrics(
        "claimed", "", "with programs of which the solver said that it solved them all",
        _solved(lambda trace: trace.claimed == 1), "share", best="high",
    ),
    *series_metrics(
        "verified", "", "with programs whose answers are all right by our own residuals",
        _solved(lambda trace: trace.verified == 1), "share", best="high",
    ),
    *series_metrics(
        "disagreed", "", "with programs at which claim and recheck disagree",
        _solved(lambda trace: trace.claimed != trace.verified), "share",
    ),
    *series_metrics(
        "optimum_distance", "rad/s",
        "distance of a solver's answer from the optimum (alpha scaling: in alpha)",
        lambda m: m.trace.distance, "max",
    ),
    *series_metrics(
        "primal_residual", "rad/s",
        "violation of a program's own constraints by an answer, recomputed",
        _solved(lambda trace: trace.primal), "max",
    ),
    *series_metrics(
        "dual_residual", "",
        "residual of a program's stationarity, recomputed; NaN without multipliers",
        _solved(lambda trace: trace.dual), "max",
    ),
    *series_metrics(
        "gap", "", "duality gap of an answer, recomputed; NaN without multipliers",
        _solved(lambda trace: trace.gap), "max",
    ),
)  # fmt: skip
