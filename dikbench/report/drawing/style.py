"""One style for all figures: colour-blind safe, readable in print."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

# Okabe & Ito 2008, without the yellow that paper swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000", "#999999")
DASHES = ("-", "--", ":", "-.")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")

WIDTH: Final = 7.2
"""Of a figure [in]: two columns of a paper."""

RESOLUTION: Final = 200
"""Of a PNG, and of what is an image in an SVG [dots per inch]."""

FEWEST_DECADES: Final = 2
"""An axis with fewer of them has numbers between its decades."""

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
        "axes.titley": 1.0,  # else it is searched for
        "xtick.labelsize": 7,
        "ytick.labelsize": 7,
        "grid.alpha": 0.25,
        "legend.fontsize": 7,
        "legend.frameon": False,
        "lines.linewidth": 1.3,
        "figure.constrained_layout.use": True,
        "figure.dpi": RESOLUTION,  # text is measured as it will be in print
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
        "linewidth": max(1.0, 2.4 - 0.35 * number),
    }


def marker(number: int) -> dict[str, Any]:
    """Colour and marker of the n-th group of points."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "marker": MARKERS[number % len(MARKERS)],
    }


def contender_name(formulation: str, solver: str) -> str:
    """How a formulation and its solver are called in a picture."""
    return formulation if solver == "none" else f"{formulation}, {solver}"


def short(name: str, most: int = LONGEST_NAME) -> str:
    """A name that fits: what cannot be written is replaced, a long one cut in its middle."""
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
    """Make an axis logarithmic, with plain numbers at decades, or 1, 2, 5 where there are few."""
    getattr(axis, f"set_{which}scale")("log")
    low, high = getattr(axis, f"get_{which}lim")()
    if not 0.0 < low < high < float("inf"):  # nothing is drawn
        low, high = getattr(axis, f"set_{which}lim")(0.1, 10.0)
    label_decades(getattr(axis, f"{which}axis"), low, high)


def label_decades(axis: Any, low: float, high: float) -> None:
    """Write the numbers of a logarithmic x or y axis between such limits."""
    decades = np.floor(np.log10(high)) - np.ceil(np.log10(low)) + 1
    if decades >= FEWEST_DECADES:
        axis.set_major_locator(LogLocator(numticks=6))
    else:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def lay_out(figure: Any) -> None:
    """Place everything in a figure; what comes later has to find its own place."""
    if isinstance(figure.get_layout_engine(), ConstrainedLayoutEngine):
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


def save(figure: Any, folder: Path, name: str) -> str:
    """Write a figure as SVG and as PNG, and return the file name of the SVG."""
    lay_out(figure)
    # Without `savefig`, which draws everything once more before it draws.
    FigureCanvasAgg(figure).print_png(folder / f"{name}.png")
    written = io.StringIO()
    FigureCanvasSVG(figure).print_svg(written, metadata={"Date": None})
    (folder / f"{name}.svg").write_text(_slim(written.getvalue()), encoding="utf-8")
    plt.close(figure)
    return f"{name}.svg"


def _slim(svg: str) -> str:
    """An SVG in half of the bytes, fit to stand in a page with others.

    Without names of groups, which the others have too, and without a style sheet, which would be
    the page's; with the font named once, no rotations by nothing, and hundredths of a point.
    """
    sheet = re.search(r"<defs>\s*<style[^>]*>\*\{([^}]*)\}</style>\s*</defs>", svg)
    font = re.search(r"font-family: [^;\"]*", svg)
    inherited = []
    if sheet:
        inherited.append(sheet[1])
        svg = svg.replace(sheet[0], "", 1)
    if font:
        inherited.append(font[0])
        svg = re.sub(r" ?" + re.escape(font[0]) + r";?", "", svg)
    svg = svg.replace("<svg ", f'<svg style="{"; ".join(inherited)}" ', 1)
    svg = re.sub(r'<g id="[^"]*"/>\s*', "", svg)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = re.sub(r' transform="rotate\(-?0 [^"]*\)"', "", svg)
    svg = re.sub(r"\n +", "\n", svg)
    numbers = re.compile(r"(-?\d+\.\d{2})\d+")
    return re.sub(
        r' (?:x|y|d|width|height|transform)="[^"]*"', lambda m: numbers.sub(r"\1", m[0]), svg
    )
