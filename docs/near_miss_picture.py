"""Draw the README's looping picture: four formulations at one near miss of a singularity.

A UR5 passes its wrist singularity on a path that waits for the robot. Above, the end of the arm and
a pointer of 0.2 m on its hand, whose tip has a wanted path (grey) and an achieved one; the view is
onto the plane of these paths. Below, the fastest joint's speed over its limit. What stands above
each is the outcome of the trial. The robot is shown three times slower than it is.

    python docs/near_miss_picture.py [FILE]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import pinocchio as pin
from matplotlib import pyplot as plt
from matplotlib.animation import FuncAnimation, PillowWriter

import dikbench
from dikbench.plugins.building import make_scenario
from dikbench.robots.stick_figure import stick

FILE: Final = Path(__file__).parent / "pictures" / "near_miss.gif"
SCENARIO: Final = "near-miss[robot=ur5,singularity=wrist,miss=0.02,speed=0.5]"
COLOURS: Final = {"pinv": "#d62728", "dls": "#1f77b4", "qp": "#9467bd", "lp-alpha": "#2ca02c"}

POINTER_M: Final = 0.2
STEPS_PER_FRAME: Final = 5
FRAMES_PER_SECOND: Final = 13
FRAMES_AT_THE_END: Final = 20


class Run:
    """A formulation's run: its joints' positions, the pointer's tip, and its speed over the limit.

    Attributes:
        said: how it ended, in words.
        arm: of each step the points of the arm and of the pointer's tip, (n, k, 3) [m].
        tip: of these the tip, (n, 3) [m].
        speed: largest share of a joint's speed limit, (n,).
    """

    def __init__(self, robot: Any, row: Any, steps: Any) -> None:
        q = steps[[f"q_{joint}" for joint in range(robot.nq)]].to_numpy()
        v = steps[[f"applied_{joint}" for joint in range(robot.nv)]].to_numpy()
        self.arm = np.array([[*stick(robot, each), tip_of(placement(robot, each))] for each in q])
        self.tip = self.arm[:, -1]
        self.speed = np.abs(v / robot.limits.velocity.upper).max(axis=1)
        self.said = {
            "limit-broken": f"breaks a limit: {row['velocity_peak_ratio']:.1f} x speed",
            "left-path": f"leaves the path: {1000 * row['contour_error_6d_max_m']:.0f} mm",
            "success": f"success, in {row['slow_down']:.2f} x the time",
        }[row["outcome"]]


def placement(robot: Any, q: Any) -> Any:
    """Compute the placement of the task frame at a configuration."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    return pin.updateFramePlacement(robot.model, data, robot.frame_id)


def tip_of(frame: Any) -> Any:
    """Return the tip of a pointer along the z axis of a placement, (3,) [m]."""
    return frame.translation + POINTER_M * frame.rotation[:, 2]


def runs() -> tuple[Any, dict[str, Run]]:
    """Run the formulations, and return the pointer's wanted path, (n, 3), and their runs."""
    with tempfile.TemporaryDirectory() as folder:
        results = dikbench.run_study(
            formulations=list(COLOURS),
            scenarios=SCENARIO,
            plants="ideal",
            references="path",
            out=folder,
            report=False,
        )
        rows = results.trials.set_index("formulation", drop=False)
        scenario = make_scenario(SCENARIO)
        found = {
            name: Run(scenario.robot, rows.loc[name], results.steps(rows.loc[[name]]))
            for name in COLOURS
        }
    times = np.linspace(0.0, scenario.reference.duration, 200)
    return np.array([tip_of(scenario.reference.placement(tau)) for tau in times]), found


def draw(file: Path) -> None:
    """Draw the picture into a GIF file."""
    wanted, found = runs()
    points = np.concatenate([wanted, *(run.tip for run in found.values())])
    plane = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][:2]
    plane *= np.sign(plane[:, 2:])  # up is up
    middle = (wanted @ plane.T).mean(axis=0)
    period = make_scenario(SCENARIO).dt
    longest = max(len(run.tip) for run in found.values())

    mpl.rcParams.update({"font.size": 8, "svg.hashsalt": "near miss"})
    figure, axes = plt.subplots(
        2, len(found), figsize=(8.4, 3.7), dpi=100, height_ratios=(2.6, 1), sharey="row"
    )
    figure.subplots_adjust(left=0.055, right=0.995, top=0.92, bottom=0.115, wspace=0.06, hspace=0.1)
    moving = []
    for (name, run), (view, chart) in zip(found.items(), axes.T, strict=True):
        colour = COLOURS[name]
        view.set_title(run.said, color=colour, fontsize=9)
        view.text(
            0.03,
            0.96,
            name,
            color=colour,
            weight="bold",
            size=11,
            va="top",
            transform=view.transAxes,
        )
        view.plot(*(wanted @ plane.T).T, color="0.65", lw=5, solid_capstyle="round", zorder=0)
        view.set(
            xticks=[], yticks=[], aspect="equal", xlim=middle[0] + np.array([-0.2, 0.2]),
            ylim=middle[1] + np.array([-0.07, 0.33]),
        )  # fmt: skip
        chart.axhline(1.0, color="0.4", lw=1, ls="--")
        chart.set(xlim=(0, longest * period), ylim=(0, 5.6), xlabel="time [s]", yticks=[0, 1, 3, 5])
        chart.spines[["top", "right"]].set_visible(False)
        moving.append(
            (
                run,
                view.plot([], [], color="0.25", lw=6, solid_joinstyle="round")[0],
                view.plot([], [], color=colour, lw=3, marker="o", markevery=[-1])[0],
                view.plot([], [], color=colour, lw=1.5)[0],
                chart.plot([], [], color=colour, lw=1.5)[0],
            )
        )
    axes[0, 0].set_ylabel(f"pointer of {POINTER_M:g} m on the hand")
    axes[1, 0].set_ylabel("speed / limit")

    def show(frame: int) -> list[Any]:
        for run, arm, pointer, trail, speed in moving:
            step = min(frame * STEPS_PER_FRAME, len(run.tip) - 1)
            body = run.arm[step] @ plane.T
            arm.set_data(*body[:-1].T)
            pointer.set_data(*body[-2:].T)
            trail.set_data(*(run.tip[: step + 1] @ plane.T).T)
            speed.set_data(period * np.arange(step + 1), run.speed[: step + 1])
        return []

    frames = [*range(longest // STEPS_PER_FRAME + 1)]
    frames += [frames[-1]] * FRAMES_AT_THE_END
    animation = FuncAnimation(figure, show, frames=frames)  # type: ignore[arg-type]
    file.parent.mkdir(exist_ok=True)
    animation.save(file, PillowWriter(fps=FRAMES_PER_SECOND))


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else FILE)
