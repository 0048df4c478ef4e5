"""Distance from the path in position alone, wherever the target is."""

from __future__ import annotations

from dikbench.metrics.metric import series_metrics

CONTOUR = series_metrics(
    "contour_error", "m", "distance of the task frame from the path, wherever the target is",
    lambda m: m.contour_error, "rms", "p95", "max", "final", source="[Koren1980]",
)  # fmt: skip
