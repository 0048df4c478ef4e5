"""Off the path and late on it: two failures that a distance from the target does not tell apart."""

from __future__ import annotations

from dikbench.metrics.metric import INF, Metric, largest, last, percentile_95, rms

CONTOUR = (
    Metric(
        "contour_error_rms_m", "m", "low", INF, "tracking error",
        "root mean square distance of the task frame from the path, wherever the target is",
        lambda m: rms(m.contour_error),
        "[Koren1980]",
    ),
    Metric(
        "contour_error_p95_m", "m", "low", INF, "tracking error",
        "95 % quantile of the distance of the task frame from the path",
        lambda m: percentile_95(m.contour_error),
        "[Koren1980]",
    ),
    Metric(
        "contour_error_max_m", "m", "low", INF, "tracking error",
        "largest distance of the task frame from the path",
        lambda m: largest(m.contour_error),
        "[Koren1980]",
    ),
    Metric(
        "contour_error_final_m", "m", "low", INF, "tracking error",
        "distance of the task frame from the path at the end",
        lambda m: last(m.contour_error),
        "[Koren1980]",
    ),
    Metric(
        "path_done_share", "", "high", 0.0, "tracking error",
        "share of the path that lies behind the task frame at the end of the run",
        lambda m: m.path_done,
    ),
    Metric(
        "lag_max_s", "s", "low", INF, "tracking error",
        "largest delay on the path: nominal time to go to the target, and how late that is itself",
        lambda m: largest(m.lag),
    ),
    Metric(
        "lag_final_s", "s", "low", INF, "tracking error",
        "delay along the path at the end",
        lambda m: last(m.lag),
    ),
)  # fmt: skip
