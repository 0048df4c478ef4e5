"""The metrics of a trial: pure functions of its recorded motion, never of what a solver said."""

from __future__ import annotations

from dikbench.metrics.every import METRICS, evaluate
from dikbench.metrics.metric import Metric
from dikbench.metrics.motion import Motion

__all__ = ["METRICS", "Metric", "Motion", "evaluate"]
