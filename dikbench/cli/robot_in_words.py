"""The description of a robot: its joints, their limits, and its frames."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import unknown
from dikbench.robots.last_link import last_moved_link
from dikbench.robots.limits import Interval
from dikbench.robots.loading import load_robot
from dikbench.robots.plugged import EVERY_ROBOT, robot_entry
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import rows_in_words
from dikbench.user_code import in_file

ROBOT_FILES: Final = (".urdf", ".xml", ".xacro")
"""How the name of a robot's file ends."""

OPTIONS: Final = ("frame", "rows", "lock", "root", "velocity", "acceleration")
"""What of a robot can be given in brackets (see `load_robot`), as for a family."""

WIDTH: Final = 100
"""Characters of a line of frames."""


def robot_in_words(name_or_urdf: str, options: Mapping[str, str]) -> str:
    """Describe a robot of the catalogue or of a URDF file.

    Args:
        name_or_urdf: the robot.
        options: of `load_robot`, by name (`OPTIONS`).

    Raises:
        DikbenchError: if there is no such robot or option, or its file cannot be read.
    """
    for name in options:
        if name not in OPTIONS:
            raise unknown(f"parameter of robot {name_or_urdf}", name, OPTIONS)
    given: dict[str, Any] = dict(options)
    if in_file(name_or_urdf) or name_or_urdf in EVERY_ROBOT:
        entry = robot_entry(name_or_urdf)
        robot = load_robot(name_or_urdf, **given)
        head = [f"{name_or_urdf}: {entry.summary}", f"  task frame: {robot.frame}"]
        if (found := EVERY_ROBOT.find(name_or_urdf)) is not None:
            head.append(f"  file: {found.file}")
        source = entry.acceleration_source
    else:
        given.setdefault("frame", last_moved_link(name_or_urdf))
        robot = load_robot(name_or_urdf, **given)
        named = f"task frame {robot.frame}"
        named = named if "frame" in options else "name its task frame with frame=..."
        head = [f"{name_or_urdf}: a robot from a URDF; {named}"]
        source = "a URDF has none"
    if "acceleration" in options:
        source = "given by hand"
    if options:
        asked = rows_in_words(robot.task_rows, robot.task_axes)
        moved = rows_in_words(robot.movable_rows, "body")
        head.append(f"  asked for: rows={asked}; its {len(robot.chain)} joints move {moved}")
    known = robot.available_acceleration is not None
    return "\n".join(
        [
            *head,
            f"  safe start [rad or m]: {np.round(robot.q0, 4).tolist()}",
            f"  {robot.nv} velocities; joints with their limits, inf where there is none:",
            *(f"    {line}" for line in _joints(robot)),
            f"  acceleration limits{'' if known else ': none are known'} ({source})",
            "  frames, each with the number of velocities that move it:",
            *textwrap.wrap(
                ", ".join(_frames(robot)), WIDTH, initial_indent="    ", subsequent_indent="    "
            ),
        ]
    )


def _joints(robot: Robot) -> list[str]:
    limits, model = robot.limits, robot.model
    named = [
        (limits.position, "position", ("rad", "m")),
        (limits.velocity, "speed", ("rad/s", "m/s")),
        (_symmetric(robot.available_acceleration), "acceleration", ("rad/s^2", "m/s^2")),
        (_symmetric(robot.available_effort), "torque or force", ("N m", "N")),
    ]
    lines, free = [], dict[int, str]()
    for name, joint in [*zip(model.names, model.joints, strict=True)][1:]:
        if joint.nv == 0:
            lines.append(f"{name} follows {free[joint.idx_v]}")
            continue
        free[joint.idx_v] = name
        slides = joint.nv == 1 and joint.shortname().startswith("JointModelP")
        kind = "slides" if slides else "turns" if joint.nv == 1 else f"{joint.nv} velocities"
        if joint.nv == 1 and joint.nq == 2:
            kind = "turns without end"
        parts = [
            f"{what} {_range(interval, joint.idx_v, both=what == 'position')} {units[slides]}"
            for interval, what, units in named
            if interval is not None and joint.nv == 1
        ]
        lines.append(f"{name} ({joint.idx_v}): {'; '.join([kind, *parts])}")
    return lines


def _symmetric(magnitude: Array | None) -> Interval | None:
    return None if magnitude is None else Interval(-magnitude, magnitude)


def _range(interval: Interval, index: int, *, both: bool) -> str:
    lower, upper = interval.lower[index], interval.upper[index]
    return f"{lower:.4g} to {upper:.4g}" if both or lower != -upper else f"{upper:.4g}"


def _frames(robot: Robot) -> list[str]:
    """List the links and other frames in the order of the model."""
    model: Any = robot.model
    counts = {}
    for frame in model.frames:
        above = [model.joints[index] for index in model.supports[frame.parentJoint]][1:]
        if frame.name != "universe":
            moving = {joint.idx_v + k for joint in above for k in range(joint.nvExtended)}
            counts[frame.name] = len(moving)
    return [f"{name} ({count})" for name, count in counts.items()]
