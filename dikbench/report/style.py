"""One style for all figures: colour-blind safe, readable in print."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt

# Okabe & Ito 2008, without the yellow that paper swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
DASHES = ("-", "--", ":", "-.")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")


@contextmanager
def style() -> Iterator[None]:
    """Draw without a screen, in the project's style."""
    settings: dict[str, Any] = {
        "font.size": 9,
        "axes.grid": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "grid.alpha": 0.25,
        "legend.fontsize": 7.5,
        "legend.frameon": False,
        "lines.linewidth": 1.3,
        "figure.constrained_layout.use": True,
        "svg.hashsalt": "dikbench",
        "svg.fonttype": "none",
    }
    backend = mpl.get_backend()
    with mpl.rc_context(settings):
        plt.switch_backend("agg")
        try:
            yield
        finally:
            plt.switch_backend(backend)


def look(number: int) -> dict[str, Any]:
    """Colour, dash and width of the n-th curve; the later the thinner: none hides another."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": DASHES[number % len(DASHES)],
        "linewidth": max(1.0, 3.2 - 0.35 * number),
    }


def marker(number: int) -> dict[str, Any]:
    """Colour and marker of the n-th group of points."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[number % len(MARKERS)],
    }


def law_name(formulation: str, solver: str) -> str:
    """How a law and its solver are called in a picture."""
    return formulation if solver == "none" else f"{formulation}, {solver}"


def save(figure: Any, folder: Path, name: str) -> str:
    """Write a figure as SVG and return its file name."""
    file = f"{name}.svg"
    figure.savefig(folder / file, metadata={"Date": None})
    plt.close(figure)
    return file


def names_in_order(values: Sequence[str]) -> list[str]:
    """Distinct names in their first order."""
    return list(dict.fromkeys(values))
