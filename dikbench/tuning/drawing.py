"""The picture of tuning: success over each parameter, where the default and the tuned value are."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any, Final

import matplotlib.pyplot as plt

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.plugins.tuned import ranges_of
from dikbench.report.drawing.style import COLOURS, WIDTH, logarithmic, save, style
from dikbench.tuning.tuning import Tuning

COLUMNS: Final = 4
PANEL_HEIGHT: Final = 1.5
"""Of a panel [in]."""


def draw_sensitivity(tunings: Sequence[Tuning], out: Path) -> Path:
    """Draw a panel per formulation and parameter: mean success of every candidate over its value.

    A panel of a formulation with several parameters shows the same candidates as its others, so
    that points one above another differ in those.

    Returns:
        The file, `sensitivity.svg`.

    Raises:
        DikbenchError: if it cannot be written.
    """
    panels = [(each, name) for each in tunings for name in ranges_of(each.scores.default)]
    rows = ceil(len(panels) / COLUMNS)
    with style():
        figure, axes = plt.subplots(
            rows,
            min(COLUMNS, len(panels)),
            figsize=(WIDTH, 0.4 + PANEL_HEIGHT * rows),
            sharey=True,
            squeeze=False,
        )
        places = axes.flat
        for axis, (each, name) in zip(places, panels, strict=False):
            _panel(axis, each, name)
        for axis in list(axes.flat)[len(panels) :]:
            axis.set_visible(False)
        for axis in axes[:, 0]:
            axis.set_ylabel("success [%]")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        try:
            save(figure, out, "sensitivity")
        except OSError as error:
            raise DikbenchError(f"folder {out}: {error.strerror or error}") from None
    return out / "sensitivity.svg"


def _panel(axis: Any, tuning: Tuning, name: str) -> None:
    """Draw the candidates of one formulation over one parameter."""
    scored = tuning.scores
    drawn = ranges_of(scored.default)[name]
    values = [float(each.parameters[name]) for each in scored.candidates]
    axis.plot(values, 100 * scored.success[1:], "o", ms=2.5, color=COLOURS[4], label="candidate")
    default = getattr(make_formulation(scored.default), name)
    level = 100 * scored.success[0]
    if default is None or not drawn.low <= default <= drawn.high:
        # Outside of the range, such as 0 on a logarithmic axis: its success as a line.
        axis.axhline(level, color=COLOURS[6], lw=0.9, ls="--")
    else:
        axis.plot([default], [level], "s", ms=5, mfc="none", color=COLOURS[6], label="_default")
    axis.plot([], [], "s--", ms=5, mfc="none", lw=0.9, color=COLOURS[6], label="default")
    if name in scored.best.parameters and scored.best != scored.default:
        best = float(scored.best.parameters[name])
        axis.plot([best], [100 * scored.best_success], "*", ms=8, color=COLOURS[1], label="_tuned")
    axis.plot([], [], "*", ms=8, color=COLOURS[1], label="tuned")
    axis.set_xlim(drawn.low, drawn.high)
    if drawn.log:
        logarithmic(axis, "x")
    axis.set_title(str(scored.default))
    axis.set_xlabel(name)
