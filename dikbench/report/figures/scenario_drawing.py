"""One scenario in a picture: its path, the robot on its way, what makes it hard against time."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib.pyplot as plt
import numpy as np

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.report.drawing.obstacle_surface import surface
from dikbench.report.drawing.style import COLOURS, style
from dikbench.robots.stick_figure import stick
from dikbench.scenario.scenario import Scenario

FORMATS: Final = (".svg", ".png", ".pdf")

POSES: Final = 5
"""Instants at which the robot is drawn, the middle one among them."""

STICKS: Final = tuple(COLOURS[number] for number in (0, 4, 2, 3, 7))

PATH_POINTS: Final = 300


def draw_scenario(selector: str, file: Path) -> None:
    """Draw a scenario and write the figure.

    Args:
        selector: the scenario.
        file: where to; its ending says in which format.

    Raises:
        DikbenchError: on a wrong selector, an ending that is none of `FORMATS`, or a file that
            cannot be written.
    """
    if file.suffix not in FORMATS:
        raise DikbenchError(f"figure {file}: valid endings: {', '.join(FORMATS)}")
    scenario = make_scenario(selector)
    with style():
        figure = plt.figure(figsize=(10.0, 5.6))
        grid = figure.add_gridspec(3, 2, width_ratios=(1.25, 1.0))
        planar = 2 not in scenario.robot.movable_rows
        left = figure.add_subplot(grid[:, 0], **({} if planar else {"projection": "3d"}))
        _draw_way(left, scenario, planar)
        right = [figure.add_subplot(grid[row, 1]) for row in range(3)]
        _draw_difficulty(right, scenario)
        figure.suptitle(selector, fontsize=9)
        try:
            figure.savefig(file, dpi=150)
        except OSError as error:
            raise DikbenchError(f"figure {file}: {error.strerror or error}") from None
        finally:
            plt.close(figure)


def _draw_way(axes: Any, scenario: Scenario, planar: bool) -> None:
    """The path of the target, the robot as a stick figure at a few instants, what is in its way."""
    used = slice(0, 2) if planar else slice(0, 3)
    taus = np.linspace(0.0, scenario.reference.duration, PATH_POINTS)
    path = np.array([scenario.reference.placement(tau).translation for tau in taus])[:, used]
    axes.plot(*path.T, color=COLOURS[1], linewidth=2.2, label="path of the target")
    axes.plot(*path[:1].T, "o", color=COLOURS[1], markersize=4)
    motion = scenario.motion
    poses, times = [scenario.q0], [0.0]
    if motion is not None:
        chosen = np.searchsorted(motion.instants, np.linspace(0, motion.instants[-1], POSES))
        poses, times = list(motion.q[chosen]), list(motion.instants[chosen])
    sticks = []
    for number, (q, time) in enumerate(zip(poses, times, strict=True)):
        sticks.append(stick(scenario.robot, q))
        axes.plot(
            *sticks[-1][:, used].T,
            "o-",
            color=STICKS[number],
            markersize=3,
            linewidth=2.6 - 0.35 * number,
            label=f"robot at {time:.2f} s",
        )
    surfaces = [surface(obstacle) for obstacle in scenario.obstacles]
    for shape in surfaces:
        axes.plot_surface(*np.moveaxis(shape, 2, 0), color=COLOURS[5], alpha=0.5)
    shapes = [shape.reshape(-1, 3) for shape in surfaces]
    points = np.vstack([path, *(points[:, used] for points in [*sticks, *shapes])])
    middle, half = (points.max(0) + points.min(0)) / 2, 0.55 * np.ptp(points, axis=0).max()
    for axis, centre in zip("xyz", middle, strict=False):
        getattr(axes, f"set_{axis}lim")(centre - half, centre + half)
        getattr(axes, f"set_{axis}label")(f"{axis} [m]")
    if planar:
        axes.set_aspect("equal")
    else:
        axes.set_box_aspect((1, 1, 1))
    axes.legend(loc="upper left")


def _draw_difficulty(panels: list[Any], scenario: Scenario) -> None:
    """Singular value, margin to the limits and required speed against time."""
    motion = scenario.motion
    labels = (
        "smallest singular\nvalue (m, rad)",
        "margin to the\nlimits [rad]",
        "required speed\nover limit",
    )
    for panel, label in zip(panels, labels, strict=True):
        panel.set_ylabel(label)
        panel.sharex(panels[-1])
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("nominal time [s]")
    if motion is None:
        for panel in panels:
            panel.set(xticks=[], yticks=[])
            text = "no joint motion does what is asked for"
            panel.text(0.5, 0.5, text, ha="center", transform=panel.transAxes)
        return
    middles = (motion.instants[1:] + motion.instants[:-1]) / 2
    panels[0].plot(motion.instants, motion.sigma_min, color=COLOURS[0])
    panels[0].set_ylim(bottom=0)
    panels[1].plot(motion.instants, motion.margin, color=COLOURS[0])
    panels[1].axhline(0.0, color=COLOURS[1], linewidth=0.8)
    panels[2].plot(middles, motion.speed_ratio, color=COLOURS[0])
    panels[2].axhline(1.0, color=COLOURS[1], linewidth=0.8)
    if motion.peak_speed_ratio > 10:
        panels[2].set_yscale("log")
