"""Pictures of an arm: its start and its singular postures; where a path comes near them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dikbench.advice.arm import Arm
from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import COLOURS, lay_out, save, style
from dikbench.report.figures.phase_diagram import draw_phase_diagrams
from dikbench.robots.stick_figure import stick
from dikbench.scenario.scenario import Scenario

MOST_POSTURES: Final = 12
"""So many singular postures are drawn."""

COLOUR_OF_KIND: Final = {"crossing": COLOURS[1], "fold": COLOURS[2], "saddle": COLOURS[3]}


def draw_arm(arm: Arm, folder: Path) -> Figure:
    """Draw the arm at its start, and at singular postures, from the side and from above."""
    robot = arm.robot
    with style():
        figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.4))
        for axis, (i, j), (across, up) in zip(
            axes, ((0, 2), (0, 1)), (("x [m]", "z [m]"), ("x [m]", "y [m]")), strict=True
        ):
            for number, each in enumerate(arm.singular[:MOST_POSTURES]):
                points = stick(robot, each.q)
                label = (
                    each.kind
                    if all(other.kind != each.kind for other in arm.singular[:number])
                    else None
                )
                axis.plot(
                    points[:, i], points[:, j], color=COLOUR_OF_KIND[each.kind], alpha=0.5,
                    linewidth=1, label=label,
                )  # fmt: skip
            points = stick(robot, robot.q0)
            axis.plot(
                points[:, i], points[:, j], color=COLOURS[0], linewidth=2.5, marker="o",
                markersize=3, label="start",
            )  # fmt: skip
            axis.set(xlabel=across, ylabel=up)
            axis.set_aspect("equal", adjustable="datalim")
        axes[0].legend()
        lay_out(figure)
        file = save(figure, folder, "arm")
    return Figure(
        file,
        "The joints of the arm at its start (blue) and at singular postures that were found inside "
        "its limits, from the side and from above.",
        f"{robot.name}: its start and singular postures",
    )


def draw_path(scenario: Scenario, folder: Path) -> Figure | None:
    """Draw along a path how near its exact motion comes to singularities and limits."""
    motion = scenario.motion
    if motion is None:
        return None
    with style():
        figure, axes = plt.subplots(3, 1, figsize=(7.2, 4.5), sharex=True)
        for axis, values, label in zip(
            axes,
            (motion.sigma_min, motion.margin, motion.speed_ratio),
            ("smallest singular\nvalue (m, rad)", "distance from a\nposition limit [rad]",
             "joint speed\nover its limit"),
            strict=True,
        ):  # fmt: skip
            axis.plot(motion.instants[: len(values)], np.asarray(values), color=COLOURS[0])
            axis.set(ylabel=label)
        axes[2].axhline(1.0, color=COLOURS[1], linestyle="--")
        axes[1].axhline(0.0, color=COLOURS[1], linestyle="--")
        axes[2].set(xlabel="time [s]")
        lay_out(figure)
        file = save(figure, folder, "path")
    return Figure(
        file,
        "Along the path, for the joint motion that follows it exactly: how near it comes to a "
        "singularity, to a position limit, and what share of the joints' speed it asks for "
        "(orange: the limits).",
        "The path: singularities, limits, speeds",
    )


def draw_phases(trials: pd.DataFrame | None, folder: Path) -> list[Figure]:
    """Draw the phase diagrams of trials of a grid; none where there are none."""
    if trials is None:
        return []
    with style():
        return draw_phase_diagrams(trials[trials["steps"].gt(0)], folder)
