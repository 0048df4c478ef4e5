"""An arm looked at: its chain and limits, what is assumed where it has none, its singularities."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.catalogue import ROBOTS
from dikbench.robots.last_link import last_moved_link
from dikbench.robots.loading import load_robot
from dikbench.robots.plugged import EVERY_ROBOT
from dikbench.robots.robot import Robot
from dikbench.robots.task_rows import rows_in_words
from dikbench.scenario.oracle import position_margin
from dikbench.scenario.singularity import Singularity, analyse, singular_postures
from dikbench.user_code import in_file

ASSUMED_SPEED_RAD_S: Final = 1.0
"""Speed limit that is assumed for a joint that turns and has none ..."""

ASSUMED_SPEED_M_S: Final = 0.25
"""... and for one that slides."""

FEWEST_JOINTS: Final = 3
"""An arm of fewer joints cannot even hold a position in space."""

JOINTS_OF_A_POSE: Final = 6
POSITION_ROWS: Final = "xyz"
"""What is asked of an arm of fewer joints than a pose has rows."""

SINGULAR_MARGIN_RAD: Final = 0.1
"""Singular postures nearer to a position limit are left out."""

NEAR_LIMIT_RAD: Final = 0.3
"""A joint this near to a limit at the start is named."""

KINDS: Final[Mapping[str, str]] = {
    "crossing": "crossings (as at a wrist: joint speeds grow as 1/distance)",
    "fold": "folds (as at a stretched elbow: joint speeds grow as 1/sqrt(distance))",
    "saddle": "saddles (only on redundant arms: joint speeds grow as 1/sqrt(distance))",
}


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm as it is tried.

    Attributes:
        robot: with the limits in force.
        parameters: what selects it in a scenario, by parameter, as texts.
        facts: what was found of it, in sentences.
        assumed: what is assumed of it, in sentences.
        singular: singular postures that were found inside its limits.
    """

    robot: Robot
    parameters: Mapping[str, str]
    facts: tuple[str, ...]
    assumed: tuple[str, ...]
    singular: tuple[Singularity, ...] = field(default=())


def look_at(name_or_urdf: str, frame: str | None = None, acceleration: str | None = None) -> Arm:
    """Look at a robot of the catalogue, of a file, or of a URDF.

    Args:
        name_or_urdf: the robot.
        frame: its task frame; default: the catalogue's, of a URDF the last of the links that most
            joints move.
        acceleration: acceleration limits (see `load_robot`); None: none are in force.

    Raises:
        DikbenchError: if it cannot be loaded, has no such frame, or too few joints.
    """
    parameters, assumed = {"robot": name_or_urdf}, list[str]()
    known = in_file(name_or_urdf) or name_or_urdf in EVERY_ROBOT
    options: dict[str, Any] = {}
    if frame is None and not known:
        frame = last_moved_link(name_or_urdf)
        if frame is not None:
            assumed.append(f"task frame {frame}, the last link that most joints move (--frame)")
    if frame is not None:
        options["frame"] = parameters["frame"] = frame
    robot = load_robot(name_or_urdf, **options)
    joints = len(robot.chain)
    if name_or_urdf not in ROBOTS and joints < JOINTS_OF_A_POSE:
        if joints < FEWEST_JOINTS:
            raise DikbenchError(
                f"robot {name_or_urdf}: {joints} joints move frame {robot.frame}; valid: a frame "
                f"that at least {FEWEST_JOINTS} joints move"
            )
        options["rows"] = parameters["rows"] = POSITION_ROWS
        assumed.append(f"only the position of {robot.frame} is asked for: {joints} joints move it")
    speeds = _with_assumed_speeds(robot, assumed)
    if speeds:
        options["velocity"] = parameters["velocity"] = speeds
    if acceleration is not None:
        options["acceleration"] = parameters["acceleration"] = acceleration
    robot = load_robot(name_or_urdf, **options)
    singular = tuple(_singular(robot))
    return Arm(robot, parameters, tuple(_facts(robot, singular)), tuple(assumed), singular)


def _with_assumed_speeds(robot: Robot, assumed: list[str]) -> str:
    """Write the speed limits of all joints, those assumed included; empty where none is missing."""
    velocity = robot.limits.velocity
    upper = np.full(robot.nv, np.inf) if velocity is None else velocity.upper.copy()
    slides = robot.joint_scale != 1.0
    missing = ~np.isfinite(upper)
    if not missing[robot.chain].any():
        return ""
    upper[missing] = np.where(slides, ASSUMED_SPEED_M_S, ASSUMED_SPEED_RAD_S)[missing]
    names = [name for name, k in _joints(robot) if missing[k] and k in robot.chain]
    some = ", ".join(names[:8]) + (" ..." if len(names) > 8 else "")
    assumed.append(
        f"a speed limit of {ASSUMED_SPEED_RAD_S:g} rad/s ({ASSUMED_SPEED_M_S:g} m/s where it "
        f"slides) for {some}: the model has none"
    )
    return " ".join(f"{value:.6g}" for value in upper)


def _joints(robot: Robot) -> list[tuple[str, int]]:
    """Name the joints with one velocity, with its index."""
    pairs = zip(robot.model.names, robot.model.joints, strict=True)
    return [(name, joint.idx_v) for name, joint in list(pairs)[1:] if joint.nv == 1]


def _singular(robot: Robot) -> list[Singularity]:
    """Find singular postures inside the position limits and classify them."""
    found = []
    if robot.limits.position is None:
        return []
    for q in singular_postures(robot, SINGULAR_MARGIN_RAD):
        try:
            found.append(analyse(robot, q))
        except DikbenchError:  # it loses two directions
            continue
    return found


def _facts(robot: Robot, singular: tuple[Singularity, ...]) -> list[str]:
    """Say what was found, in sentences."""
    names = dict((k, name) for name, k in _joints(robot))
    chain = ", ".join(names.get(int(k), f"velocity {k}") for k in robot.chain)
    rows = rows_in_words(robot.task_rows, robot.task_axes)
    facts = [f"{len(robot.chain)} joints move {robot.frame}: {chain}; asked for: rows {rows}"]
    position = robot.limits.position
    if position is not None:
        without = [
            names.get(int(k), str(k))
            for k in robot.chain
            if not (np.isfinite(position.lower[k]) and np.isfinite(position.upper[k]))
        ]
        if without:
            facts.append(f"turn without end, or have no position limit: {', '.join(without)}")
        facts += _near_limits(robot, names)
        margin = position_margin(robot, robot.q0)
        facts.append(f"its start is {margin:.3g} rad from the nearest position limit")
    if robot.limits.acceleration is None:
        facts.append("no acceleration limits are in force (--acceleration)")
    if singular:
        counts = Counter(each.kind for each in singular)
        kinds = "; ".join(f"{number} {KINDS[kind]}" for kind, number in counts.most_common())
        facts.append(f"singular postures found inside its limits from 24 starts: {kinds}")
    else:
        facts.append("no singular posture was found inside its limits from 24 starts")
    return facts


def _near_limits(robot: Robot, names: Mapping[int, str]) -> list[str]:
    """Name the joints that are near a limit at the start."""
    at = robot.limits.at(robot.q0)
    assert at.to_lower is not None
    assert at.to_upper is not None
    margin: Array = np.minimum(at.to_lower, at.to_upper) / robot.joint_scale
    near = [int(k) for k in robot.chain if margin[k] < NEAR_LIMIT_RAD]
    if not near:
        return []
    some = ", ".join(f"{names.get(k, k)} ({margin[k]:.2g} rad)" for k in near)
    return [f"near a position limit at its start: {some}"]
