"""The metrics of a trial: everything that the author of a metric imports.

A metric is a pure function of the recorded motion. Most are reductions of a series
(`series_metrics`), which has a value per step or instant of a `Motion`.
"""

from __future__ import annotations

from dikbench.metrics.every import METRICS, evaluate
from dikbench.metrics.judging import judge, outcome_columns
from dikbench.metrics.measuring import Measured, measure
from dikbench.metrics.metric import Metric, series_metrics
from dikbench.metrics.motion import Motion
from dikbench.metrics.motion_of_trace import motion_of
from dikbench.metrics.outcome import (
    OUTCOME_NUMBERS,
    OUTCOME_SENTENCES,
    OUTCOME_TEXTS,
    Judgement,
    Outcome,
    Verdict,
)
from dikbench.metrics.plugged import (
    EVERY_METRIC,
    OtherMetric,
    described,
    evaluate_others,
    other_metrics,
    take_errors,
)
from dikbench.metrics.reductions import REDUCTIONS
from dikbench.metrics.violation import VIOLATION_TOLERANCE

__all__ = [
    "EVERY_METRIC",
    "METRICS",
    "OUTCOME_NUMBERS",
    "OUTCOME_SENTENCES",
    "OUTCOME_TEXTS",
    "REDUCTIONS",
    "VIOLATION_TOLERANCE",
    "Judgement",
    "Measured",
    "Metric",
    "Motion",
    "OtherMetric",
    "Outcome",
    "Verdict",
    "described",
    "evaluate",
    "evaluate_others",
    "judge",
    "measure",
    "motion_of",
    "other_metrics",
    "outcome_columns",
    "series_metrics",
    "take_errors",
]
