"""The metrics of a trial: pure functions of its recorded motion, never of what a solver said."""

from __future__ import annotations

from dikbench.metrics.metric import Metric
from dikbench.metrics.registry import METRICS, evaluate

__all__ = ["METRICS", "Metric", "evaluate"]
