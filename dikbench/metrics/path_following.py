"""How a motion follows its path in position and orientation: off it, along it, and how late."""

from __future__ import annotations

from collections.abc import Callable
from math import atan2, pi
from typing import Final

import numpy as np

from dikbench.metrics.along_path import AlongPath
from dikbench.metrics.metric import Metric, series_metrics
from dikbench.metrics.motion import Motion
from dikbench.problem.progress import DWELL_SPEED_M_S
from dikbench.simulation.clock import path_has_ended

INF: Final = float("inf")
NAN: Final = float("nan")


def slow_down(motion: Motion) -> float:
    """Compute the time at which a reference that waits is at its end, over its nominal duration.

    Infinite where it never is; NaN where the reference moves with the clock.
    """
    trace, duration = motion.trace, motion.scenario.reference.duration
    if trace.mode == "time":
        return NAN
    return trace.steps * trace.dt / duration if path_has_ended(trace.tau[-1], duration) else INF


def course(motion: Motion) -> float:
    """Compute the angle between the motion and the path, all steps together [rad].

        atan2(sum |across|, sum |along|)

    of the steps of x (see `Embedding`), across and along the path's tangent: the mean of those
    where it is nearest to the beginning and to the end of the step. Dwells do not count. NaN where
    nothing moves and where there is no path.
    """
    if motion.along_path is None:
        return NAN
    path = motion.along_path.path
    samples = path.last_until(motion.trace.tau[:-1])
    # At the end the reference rests.
    speeds = np.append(np.sqrt(path.squares) / np.diff(path.times), 0.0)[samples]
    moving = speeds > DWELL_SPEED_M_S
    if not moving.any():
        return NAN
    along, across = motion.along_and_across[moving].T.copy()
    if not (along.any() or across.any()):
        return NAN
    return atan2(float(across.sum()), float(np.abs(along).sum()))


def _along(values: Callable[[AlongPath], float]) -> Callable[[Motion], float]:
    """Take a value of motions along a path; NaN of others."""
    return lambda motion: NAN if motion.along_path is None else values(motion.along_path)


PATH_FOLLOWING = (
    *series_metrics(
        "tracking_error_6d", "m",
        "distance from the target in position and orientation, sqrt(|dp|^2 + (2 L sin(a/2))^2), "
        "L = 0.2 m",
        lambda m: m.tracking_error, "rms", "p95", "max", "final",
    ),
    *series_metrics(
        "contour_error_6d", "m",
        "distance from the path in position and orientation (L = 0.2 m), wherever the target is",
        lambda m: m.contour_error_6d, "rms", "p95", "max", "final", source="[Koren1980]",
    ),
    Metric(
        "path_done_share", "", "high", 0.0,
        "share of the path that is covered in its order, within the scenario's tolerance",
        _along(lambda a: a.done),
    ),
    Metric(
        "path_done_99_tolerance_m", "m", "low", INF,
        "smallest tolerance at which 99 % of the path is covered; inf above 0.25 m",
        _along(lambda a: a.tolerances[0]),
    ),
    Metric(
        "path_done_90_tolerance_m", "m", "low", INF,
        "smallest tolerance at which 90 % of the path is covered; inf above 0.25 m",
        _along(lambda a: a.tolerances[1]),
    ),
    *series_metrics(
        "lag", "s",
        "delay on the path: nominal time from what is covered of it to the target, until that ends",
        lambda m: np.empty(0) if m.along_path is None else m.along_path.lag, "max", "final",
    ),
    Metric(
        "lag_tolerance_m", "m", "low", INF,
        "smallest tolerance at which the final lag is at most 0.1 s or 5 % of the duration",
        _along(lambda a: a.tolerances[2]),
    ),
    Metric(
        "slow_down", "", "low", INF,
        "time until a path that waits is at its end over its nominal duration; inf if it never is",
        slow_down,
    ),
    Metric(
        "course_rad", "rad", "low", pi / 2,
        "angle between the motion and the path's tangent, all steps together (L = 0.2 m)", course,
    ),
)  # fmt: skip
