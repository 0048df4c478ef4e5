"""One style for all figures: colour-blind safe, readable in print."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

# Okabe & Ito 2008, without the yellow that paper swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
DASHES = ("-", "--", ":", "-.")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")

WIDTH: Final = 7.2
"""Of a figure [in]: two columns of a paper."""

RESOLUTION: Final = 200
"""Of a PNG, and of what is an image in an SVG [dots per inch]."""

LONGEST_NAME: Final = 26
"""Characters of a name that find room."""


@contextmanager
def style() -> Iterator[None]:
    """Draw without a screen, in the project's style."""
    settings: dict[str, Any] = {
        "font.size": 8,
        "font.sans-serif": ["DejaVu Sans", "Verdana"],
        "text.parse_math": False,  # a name may hold a dollar sign
        "axes.grid": True,
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.titlesize": 7.5,
        "xtick.labelsize": 7,
        "ytick.labelsize": 7,
        "grid.alpha": 0.25,
        "legend.fontsize": 7,
        "legend.frameon": False,
        "lines.linewidth": 1.3,
        "figure.constrained_layout.use": True,
        "svg.hashsalt": "dikbench",
        "svg.fonttype": "none",
    }
    backend = mpl.get_backend()
    with mpl.rc_context(settings), warnings.catch_warnings():
        # A browser has the characters that matplotlib's font lacks.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
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
        "linewidth": max(1.0, 2.8 - 0.4 * number),
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


def short(name: str, most: int = LONGEST_NAME) -> str:
    """A name that fits: characters that cannot be written replaced, a long one cut in its middle."""
    written = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in name)
    if len(written) <= most:
        return written
    tail = most // 2
    return f"{written[: most - tail - 1]}\N{HORIZONTAL ELLIPSIS}{written[-tail:]}"


def file_name(*parts: object) -> str:
    """A name for a file from words of which some are the user's."""
    words = (re.sub(r"[^A-Za-z0-9_-]+", "-", str(part)).strip("-")[:40] for part in parts)
    return "_".join(word for word in words if word)


def logarithmic(axis: Any, which: str) -> None:
    """Make an axis logarithmic, with plain numbers at its decades."""
    getattr(axis, f"set_{which}scale")("log")
    part = getattr(axis, f"{which}axis")
    part.set_major_locator(LogLocator(numticks=6))
    part.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    part.set_minor_formatter(NullFormatter())


def save(figure: Any, folder: Path, name: str) -> str:
    """Write a figure as SVG and as PNG, and return the file name of the SVG."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, for both
    figure.savefig(folder / f"{name}.svg", metadata={"Date": None}, dpi=RESOLUTION)
    figure.savefig(folder / f"{name}.png", dpi=RESOLUTION)
    plt.close(figure)
    return f"{name}.svg"


def names_in_order(values: Sequence[str]) -> list[str]:
    """Distinct names in their first order."""
    return list(dict.fromkeys(values))
