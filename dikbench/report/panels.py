"""Small multiples: a panel for each law, on shared axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.pyplot as plt

from dikbench.report.style import WIDTH, short

ACROSS = 4
"""Panels side by side."""


def small_multiples(names: Sequence[str], height: float) -> tuple[Any, list[Any]]:
    """A figure with a panel of a given height [in] for each name, which stands above it."""
    across = min(ACROSS, len(names))
    down = -(-len(names) // across)
    figure, grid = plt.subplots(
        down,
        across,
        figsize=(0.5 + across * (WIDTH - 0.5) / ACROSS, 1.0 + down * height),
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    axes = list(grid.flat)
    for axis in axes[len(names) :]:
        axis.remove()
    for axis, name in zip(axes, names, strict=False):
        axis.set_title(short(name), pad=3)
    for axis in axes[max(0, len(names) - across) : len(names)]:
        axis.tick_params(labelbottom=True)  # where the panel below it is missing
    return figure, axes[: len(names)]
