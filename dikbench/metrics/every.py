"""All metrics, and their values for a motion."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dikbench.metrics.chatter import CHATTER
from dikbench.metrics.contour import CONTOUR
from dikbench.metrics.distance_and_torque import CONSTRAINTS
from dikbench.metrics.freeze import FREEZE
from dikbench.metrics.metric import Metric
from dikbench.metrics.motion import Motion, is_finite
from dikbench.metrics.null_space_drift import NULL_SPACE_DRIFT
from dikbench.metrics.path_following import PATH_FOLLOWING
from dikbench.metrics.smoothness import SMOOTHNESS
from dikbench.metrics.solver import SOLVER
from dikbench.metrics.tracking import TRACKING
from dikbench.metrics.violation import VIOLATION

_KINDS = (
    TRACKING, PATH_FOLLOWING, CONTOUR, NULL_SPACE_DRIFT, VIOLATION, CONSTRAINTS, SMOOTHNESS,
    CHATTER, FREEZE, SOLVER,
)  # fmt: skip

METRICS: Mapping[str, Metric] = MappingProxyType(
    {metric.name: metric for kind in _KINDS for metric in kind}
)
"""Every metric by its name, in the order of the columns."""


def evaluate(motion: Motion) -> dict[str, float]:
    """Compute every metric of a motion, by name.

    For a motion that is not finite each metric has its worst value.
    """
    if motion.whole is None and not is_finite(motion.trace):
        return {name: metric.worst for name, metric in METRICS.items()}
    return {name: metric.of(motion) for name, metric in METRICS.items()}
