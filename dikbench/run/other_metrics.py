"""Metrics of other authors in a run: their columns, and what is said of them."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from dikbench.metrics import described, other_metrics
from dikbench.results.store import Store


def clear_outdated(store: Store, metrics: Iterable[str], out: Path) -> None:
    """Give metrics their columns; values that another source computed are deleted.

    Raises:
        DikbenchError: if a metric is unknown, or has the name of another column.
    """
    if changed := store.add_other_metrics(described(other_metrics(metrics))):
        print(
            f"deleted, computed by another source: the values of {', '.join(changed)}; "
            f"`dikbench recompute {out}` computes them from the traces",
            file=sys.stderr,
        )


def tell(errors: Mapping[str, str]) -> None:
    """Say of which metrics some values are missing, and why."""
    for name, reason in errors.items():
        print(f"metric {name} has no value of some trials: {reason}", file=sys.stderr)
