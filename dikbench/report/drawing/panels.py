"""Small multiples: a panel for each formulation, on shared axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import matplotlib.pyplot as plt

from dikbench.report.drawing.style import WIDTH, short

ACROSS: Final = 4
"""Panels side by side, at most."""

# Around and between panels [in]; laid out here, which is much faster than letting matplotlib look.
LEFT: Final = 0.62
RIGHT: Final = 0.06
BOTTOM: Final = 0.62
BESIDE: Final = 0.13
BELOW: Final = 0.24

EDGE: Final = 0.05
"""From the edge of the figure to what stands there [in]."""


def small_multiples(
    names: Sequence[str], height: float, x_label: str, y_label: str, top: float
) -> tuple[Any, list[Any]]:
    """A figure with a panel of a given height [in] for each name, which stands above it.

    There is room [in] for a legend or a colour bar at the top.
    """
    across = min(ACROSS, len(names))
    down = -(-len(names) // across)
    columns = max(across, 2)
    width = (WIDTH - LEFT - RIGHT - (columns - 1) * BESIDE) / columns
    total = top + down * height + (down - 1) * BELOW + BOTTOM
    figure, grid = plt.subplots(
        down,
        across,
        figsize=(WIDTH, total),
        sharex=True,
        sharey=True,
        squeeze=False,
        layout="none",
        gridspec_kw={
            "left": LEFT / WIDTH,
            "right": (LEFT + across * width + (across - 1) * BESIDE) / WIDTH,
            "bottom": BOTTOM / total,
            "top": 1.0 - top / total,
            "wspace": BESIDE / width,
            "hspace": BELOW / height,
        },
    )
    axes = list(grid.flat)
    for axis in axes[len(names) :]:
        axis.remove()
    axes = axes[: len(names)]
    for axis, name in zip(axes, names, strict=True):
        axis.set_title(short(name), pad=3)
        axis.tick_params(bottom=False, left=False)
    for axis in axes[-across:]:
        axis.tick_params(labelbottom=True)  # those below which a panel is missing, too
    figure.supxlabel(x_label, y=EDGE / total, fontsize=8)
    middle = 0.5 + 0.5 * (BOTTOM - top) / total
    figure.supylabel(y_label, x=EDGE / WIDTH, y=middle, va="center", fontsize=8)
    return figure, axes


def place_at_top(figure: Any, width: float, height: float, down: float) -> Any:
    """Axes in the middle of the room at the top, so many inches down from the edge."""
    total = figure.get_figheight()
    left = 0.5 + 0.5 * LEFT / WIDTH - 0.5 * width / WIDTH
    return figure.add_axes((left, 1.0 - (down + height) / total, width / WIDTH, height / total))
