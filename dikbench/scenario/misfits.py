"""Whether the parts of a scenario fit together: tasks, reference, start and exact motion.

Where they do not, a run would measure something else than it says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.robots.kinematics import Kinematics
from dikbench.scenario.building import placement_of
from dikbench.scenario.oracle import OracleMotion
from dikbench.scenario.placing import OURS
from dikbench.scenario.scenario import Scenario

LARGEST_ERROR: Final = 1e-6
"""The largest tracking error (m, rad) that an exact motion may leave."""

SAMPLES: Final = 25
"""Instants at which a reference is looked at."""


def misfits(scenario: Scenario) -> Iterator[str]:
    """Yield what does not fit, in one line each: what, where, what would be valid.

    What comes later may only make sense where nothing came before.
    """
    yield from _wrong_sizes(scenario)
    yield from _wrong_tasks(scenario)
    yield from _out_of_the_plane(scenario)
    yield from _off_the_reference(scenario)


def _wrong_sizes(scenario: Scenario) -> Iterator[str]:
    robot = scenario.robot
    for name, value, size in (("q0", scenario.q0, robot.nq), ("v0", scenario.v0, robot.nv)):
        if value.shape != (size,) or not np.isfinite(value).all():
            yield f"{name} must be {size} finite numbers, got {value.tolist()}"
    motion = scenario.motion
    if motion is not None and motion.q.shape != (len(motion.instants), robot.nq):
        yield (
            f"motion.q must hold {robot.nq} numbers for each of {len(motion.instants)} instants, "
            f"got {motion.q.shape}"
        )


def _wrong_tasks(scenario: Scenario) -> Iterator[str]:
    """Look at gains, priorities, and the frame that is tracked."""
    others = {f"tasks[{number}]": task for number, task in enumerate(scenario.tasks)}
    for name, task in {"tracking": scenario.tracking, **others}.items():
        if not (isinstance(task.priority, int) and task.priority >= 1):
            yield f"{name}.priority is {task.priority}; valid: 1 (the most important), 2, ..."
        gain = getattr(task, "gain", 1.0)
        if not (0 <= gain < np.inf and (gain > 0 or name != "tracking")):
            least = "above 0" if name == "tracking" else "at least 0"
            yield f"{name}.gain is {gain}; valid: finite and {least} [1/s]"
    frame, expected = getattr(scenario.tracking, "frame", None), scenario.robot.frame
    if frame not in (None, expected):
        yield (
            f"tracking follows the frame {frame!r}, the reference is for {expected!r}; "
            f"valid: None, {expected!r} (give the family frame={frame})"
        )
    kinematics = Kinematics(scenario.robot)
    kinematics.update(scenario.q0)
    error = scenario.tracking.linearize(kinematics, *scenario.target(0.0)).error
    if len(error) != len(scenario.rows):
        yield (
            f"tracking has an error of {len(error)} numbers; valid: {len(scenario.rows)}, one "
            "for each of its rows(robot)"
        )


def _out_of_the_plane(scenario: Scenario) -> Iterator[str]:
    """Look for motion of the reference that the robot cannot make, and that no error would show."""
    robot, reference = scenario.robot, scenario.reference
    tracked = scenario.rows
    lost = [
        row
        for row in range(6)
        if row not in robot.movable_rows and any((row < 3) == (other < 3) for other in tracked)
    ]
    if not lost:
        return
    start = placement_of(robot, scenario.q0)
    for tau in np.linspace(0.0, reference.duration, SAMPLES):
        away = pin.log6(start.actInv(reference.placement(tau))).np
        most = max(np.abs(away[lost]).max(), np.abs(reference.velocity(tau)[lost]).max())
        if most > LARGEST_ERROR:
            yield (
                f"at {tau:.4g} s the reference leaves the plane in which {robot.name} moves, by "
                f"{most:.2g} (m, rad, m/s or rad/s); valid: a path in it, or another robot"
            )
            return


def _off_the_reference(scenario: Scenario) -> Iterator[str]:
    """Look whether the exact motion begins at the start and does what is tracked.

    A target at rest is to be reached at the end; how, is the family's.
    """
    robot, reference, motion = scenario.robot, scenario.reference, scenario.motion
    if motion is None:
        return
    away = np.abs(pin.difference(robot.model, scenario.q0, motion.q[0])).max()
    if not away <= LARGEST_ERROR:
        yield f"motion.q[0] is {away:.2g} rad away from q0; valid: a motion that begins at q0"
    if not (samples := _doubtful(scenario, motion) if reference.moving else [-1]):
        return
    kinematics = Kinematics(robot)
    for k in samples:
        tau = float(motion.instants[k])
        kinematics.update(motion.q[k])
        error = np.abs(scenario.first.linearize(kinematics, reference.placement(tau)).error).max()
        if not error <= LARGEST_ERROR:
            yield (
                f"at {tau:.4g} s the exact motion leaves an error of {error:.2g} (m, rad) of "
                f"{type(scenario.tracking).__name__}, which tracks; valid: at most "
                f"{LARGEST_ERROR:g}, as of exact_motion(robot, reference, q0, tracking)"
            )
            return


def _doubtful(scenario: Scenario, motion: OracleMotion) -> Sequence[int]:
    """Return the samples of a motion of which it is not plain that they do what is tracked.

    It is where the placement is the target's: then the error of a task on the frame is at most the
    distance and 2.2 times the largest difference of the rotations' entries.
    """
    robot, first = scenario.robot, scenario.first
    if type(first) not in OURS or getattr(first, "frame", None) not in (None, robot.frame):
        return range(len(motion.q))
    placed, (R, p) = motion.placements(robot), scenario.reference.placements(motion.instants)
    turned = np.abs(placed[:, :3, :3].mT @ R - np.eye(3)).max(axis=(1, 2))
    away = np.linalg.norm(placed[:, :3, 3] - p, axis=1)
    near = (turned < LARGEST_ERROR / 4) & (away < LARGEST_ERROR / 4)
    return [int(k) for k in np.flatnonzero(~near)]
