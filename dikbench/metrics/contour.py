"""Distance from the path, and delay along it: parts of the distance from the target."""

from __future__ import annotations

from dikbench.metrics.metric import Metric, series_metrics

CONTOUR = (
    *series_metrics(
        "contour_error", "m", "distance of the task frame from the path, wherever the target is",
        lambda m: m.contour_error, "rms", "p95", "max", "final", source="[Koren1980]",
    ),
    Metric(
        "path_done_share", "", "high", 0.0,
        "share of the path that lies behind the task frame at the end of the run",
        lambda m: m.path_done,
    ),
    *series_metrics(
        "lag", "s", "delay on the path: nominal time to the target, and how late the target is",
        lambda m: m.lag, "max", "final",
    ),
)  # fmt: skip
