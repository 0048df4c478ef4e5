"""Distance to the nearest joint limit against time, where a scenario is about joint limits."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.arrays import Array
from dikbench.metrics import Motion
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import COLOURS, WIDTH, look, save, short
from dikbench.report.selection.declared import declared_family
from dikbench.report.selection.rows import how, one_way
from dikbench.report.selection.stored_motions import (
    in_panels,
    points_per_curve,
    stored_motions,
    thinned,
)
from dikbench.results.folder import ResultsFolder


def draw_joint_margins(
    folder: ResultsFolder, ran: pd.DataFrame, example: str, target: Path
) -> list[Figure]:
    """Draw the margins of the study's example, or of the first scenario that is about them."""
    scenario = _about_limits(example, ran)
    if scenario is None:
        return []
    motions = stored_motions(folder, ran, scenario)
    margins = {name: joint_margin(motion) for name, motion in motions.items()}
    margins = {name: margin for name, margin in margins.items() if np.isfinite(margin).any()}
    margins = dict(sorted(margins.items(), key=lambda item: -np.nanmin(item[1])))
    if not margins:
        return []
    panels = in_panels(list(margins))
    across = min(2, len(panels))
    down = -(-len(panels) // across)
    figure, axes = plt.subplots(
        down,
        across,
        figsize=(WIDTH, 0.6 + 1.6 * down),
        sharex=True,
        sharey=True,
        squeeze=False,
    )
    most = points_per_curve(len(margins))
    for axis, names in zip(axes.flat, panels, strict=False):
        for number, name in enumerate(names):
            time, curve = thinned(margins[name], motions[name].trace.dt, most, np.fmin)
            axis.plot(time, curve, label=short(name, 22), **look(number))
        axis.axhline(0.0, color=COLOURS[1], linewidth=0.8, zorder=1)
        axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    for axis in axes.flat[len(panels) :]:
        axis.remove()
    axes[0, 0].margins(x=0)
    low, high = axes[0, 0].get_ylim()
    for axis in axes.flat[: len(panels)]:
        axis.axhspan(min(low, 0.0), 0.0, color=COLOURS[1], alpha=0.1, linewidth=0)
    axes[0, 0].set_ylim(low, high)
    figure.supxlabel("time [s]", fontsize=8)
    figure.supylabel("margin to the nearest joint limit [rad]", fontsize=8)
    caption = (
        f"Distance of the joint nearest to one of its position limits from it: {scenario}, "
        f"{how(one_way(ran[ran['scenario'].eq(scenario)]))}, one solver per law, those that "
        "keep farthest away first. Below 0, shaded, a joint is outside."
    )
    file = save(figure, target, "joint_margins_against_time")
    return [Figure(file, caption, "Margin to the joint limits against time")]


def joint_margin(motion: Motion) -> Array:
    """Distance of the joint nearest to one of its limits, (n + 1,) [rad]; negative outside.

    Infinite where no position limit is in force.
    """
    limits = motion.scenario.robot.limits
    if limits.position is None:
        return np.full(len(motion.trace.q), np.inf)
    q = motion.trace.q[:, limits.q_index]
    margin: Array = np.minimum(q - limits.position.lower, limits.position.upper - q).min(axis=1)
    return margin


def _about_limits(example: str, ran: pd.DataFrame) -> str | None:
    """Choose a scenario of a family that is about position limits: the example, or the first."""
    families = dict(zip(ran["scenario"], ran["scenario_family"], strict=True))
    about = [
        scenario
        for scenario, name in families.items()
        if (family := declared_family(name)) is not None and family.about_position_limits
    ]
    return example if example in about else next(iter(about), None)
