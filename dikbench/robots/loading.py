"""Robots by name and from a user's URDF: frame, rows, locked joints, root, limits, start."""

from __future__ import annotations

import os.path
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from math import isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import LONGEST_CHARACTERS, NEAREST_NAMES, DikbenchError, in_words, unknown
from dikbench.robots.catalogue import ROBOTS, CatalogueEntry
from dikbench.robots.example_robot_data import DataModel, data_file, urdf_visuals
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.mimic import with_followers
from dikbench.robots.plugged import EVERY_ROBOT, robot_entry
from dikbench.robots.reduced_model import reduced_geometry, reduced_model
from dikbench.robots.robot import Robot, checked_vector, frame_id, model_limits
from dikbench.robots.safe_start import safe_start
from dikbench.robots.task_rows import parsed_rows
from dikbench.robots.urdf import Root, urdf_model
from dikbench.user_code import in_file

POSTURES_LOOKED_AT: Final = 4
"""Postures at which it is seen which rows of a twist an arm moves."""

IMMOVABLE: Final = 1e-9
"""A row of the Jacobian (m, rad) whose largest entry is smaller is not moved."""

Locked = str | Sequence[str] | Mapping[str, float]
"""Names of joints, in a text separated by spaces, or with their positions: `joint=0.02`."""

LimitNumbers = float | str | Sequence[float]
"""One number for all joints or one for each, in a text separated by spaces."""


def load_robot(
    name_or_urdf: str,
    frame: str | None = None,
    *,
    start: object = None,
    rows: str | None = None,
    lock: Locked | None = None,
    root: Root = "fixed",
    velocity: LimitNumbers | None = None,
    acceleration: LimitNumbers | None = None,
) -> Robot:
    """Load a robot by name, or from any URDF file together with the name of its task frame.

    A robot of yours that is built in code is named as `path/to/file.py:NAME`.

    Position and velocity limits are the model's. Effort limits, and the acceleration limits of the
    catalogue, are known but not in force (see `Robot.with_limits`). Joints that mimic others in the
    URDF follow them: they have no velocity of their own, and their limits hold.

    Args:
        name_or_urdf: a name of `dikbench list robots`, `path/to/file.py:NAME`, or the path of a
            URDF file.
        frame: the task frame; default: the catalogue's. A URDF has no default.
        start: the safe start, shape (nq,) [rad]; default: the catalogue's, for a URDF the
            best-conditioned of 64 seeded postures inside the limits.
        rows: the rows of the frame's twist that tasks ask for, such as `xyz` for its position,
            `rxryrz` for its orientation, `world:xy`; default: the catalogue's, all six of a URDF.
        lock: joints that do not move, with or without their positions [rad or m]; default: at the
            catalogue's start, for a URDF at the position inside their limits next to zero.
        root: what is between the world and the root link of a URDF: `fixed`, `planar` or `free`.
        velocity: velocity limits in force [rad/s or m/s], instead of the model's.
        acceleration: acceleration limits in force [rad/s^2 or m/s^2].

    Raises:
        DikbenchError: on an unknown robot, frame, joint or row, a file that is missing or makes no
            sense, a frame that no joint moves, or a start or a position outside the limits.
    """
    text = str(name_or_urdf)
    if in_file(text) or text in EVERY_ROBOT:
        if root != "fixed":
            raise DikbenchError(f"robot {text}: root={root} is for a URDF; valid: fixed")
        robot = _named(text)
    elif text.endswith((".urdf", ".xml", ".xacro")) or "/" in text or os.path.isfile(text):
        robot = _from_urdf(text, frame, root)
    else:
        raise unknown("robot", text, EVERY_ROBOT.names(), "(or give the path of a .urdf file)")
    if frame is not None and frame != robot.frame:
        frame_id(robot.model, frame)
        robot = replace(robot, frame=frame)
    if rows is not None:
        task_rows, axes = parsed_rows(rows)
        robot = replace(robot, task_rows=task_rows, task_axes=axes)
    locked = _positions(robot, lock)
    if locked:
        robot = _with_locked(robot, locked)
    if not len(robot.chain):
        raise DikbenchError(f"robot {text}: no joint moves frame {robot.frame}")
    _check_ranges(robot)
    if text not in ROBOTS:
        robot = replace(robot, movable_rows=_movable_rows(robot))
        if start is None:
            robot = replace(robot, q0=safe_start(robot))
    if velocity is not None:
        robot = robot.with_limits(velocity=limit_numbers(velocity, "velocity"))
    if acceleration is not None:
        bound = limit_numbers(acceleration, "acceleration")
        robot = robot.with_limits(acceleration=bound)
        known = robot.limits.acceleration
        assert known is not None
        robot = replace(robot, available_acceleration=known.upper)
    if start is None:
        return robot
    q0 = checked_vector(start, robot.nq, f"start of {text}")
    if np.any(robot.inside(q0) != q0):
        raise DikbenchError(f"start of {text}: {q0.tolist()} is outside the position limits")
    return replace(robot, q0=q0)


def limit_numbers(value: LimitNumbers, kind: str) -> float | list[float]:
    """Read the magnitudes of a limit given by hand: one number, or one per joint.

    Raises:
        DikbenchError: if it is neither.
    """
    parts = value.split() if isinstance(value, str) else np.ravel(value)
    try:
        numbers = [float(part) for part in parts]
    except (TypeError, ValueError):
        numbers = []
    if not numbers or not all(number > 0 for number in numbers):
        raise DikbenchError(
            f"{kind}={value!r} is not valid; valid: a number above 0 for all joints, or one for "
            "each, separated by spaces"
        )
    return numbers[0] if len(numbers) == 1 else numbers


@lru_cache
def _named(name: str) -> Robot:
    """Make a robot of the catalogue, or of another author, from its entry."""
    entry = robot_entry(name)
    if name in ROBOTS:
        return robot_of_entry(name, entry)
    try:
        return robot_of_entry(name.rpartition(":")[2], entry)
    except MemoryError:
        raise
    except Exception as error:
        said = str(error) if isinstance(error, DikbenchError) else in_words(error)
        raise DikbenchError(f"robot {name}: {said}") from error


def robot_of_entry(name: str, entry: CatalogueEntry) -> Robot:
    """Make the robot of an entry, under a name."""
    model = entry.model()
    model.name = name
    limits = model_limits(model).with_interval("effort", None)
    acceleration = None if entry.acceleration is None else np.array(entry.acceleration, dtype=float)
    q0 = pin.integrate(model, pin.neutral(model), np.array(entry.start, dtype=float))
    robot = Robot(
        name,
        model,
        entry.frame,
        limits,
        q0,
        entry.task_rows,
        movable_rows=entry.task_rows,
        available_acceleration=acceleration,
    )
    if not isinstance(entry.model, DataModel):
        return robot
    srdf = entry.model.srdf
    return replace(
        robot,
        visuals=entry.model.visuals,
        urdf=data_file(entry.model.urdf),
        srdf=None if srdf is None else data_file(srdf),
    )


def _from_urdf(path: str, frame: str | None, root: Root) -> Robot:
    """Load a URDF; its start is the neutral configuration, moved inside the limits."""
    model, following = urdf_model(path, root)
    if frame is None:
        frames = [f.name for f in model.frames if f.name != "universe"]
        listed = ", ".join(frames)
        if len(listed) > LONGEST_CHARACTERS:
            some = ", ".join(frames[-NEAREST_NAMES:])
            listed = f"{some}, ... ({len(frames)} in all, listed by `dikbench show {path}`)"
        raise DikbenchError(f"robot file {path}: name its task frame; valid: {listed}")
    limits = with_followers(model_limits(model), model, following, path)
    limits = limits.with_interval("effort", None)
    visuals = partial(urdf_visuals, model, path, Path(path).absolute().parent)
    robot = Robot(
        Path(path).stem, model, frame, limits, pin.neutral(model), visuals=visuals, urdf=path
    )
    return replace(robot, q0=robot.inside(robot.q0))


def _positions(robot: Robot, lock: Locked | None) -> dict[str, float | None]:
    """Read which joints are locked, and where if that is given."""
    found: dict[str, float | None] = {}
    if isinstance(lock, Mapping):
        lock = [f"{name}={value}" for name, value in lock.items()]
    for item in lock.split() if isinstance(lock, str) else lock or ():
        name, equals, value = str(item).partition("=")
        try:
            if name in found or (equals and not isfinite(float(value))):
                raise ValueError
            found[name] = float(value) if equals else None
        except ValueError:
            raise DikbenchError(
                f"lock={item!r} is not valid; valid: names of joints of robot {robot.name}, each "
                "once, or joint=position"
            ) from None
    return found


def _with_locked(robot: Robot, locked: Mapping[str, float | None]) -> Robot:
    """Return the robot with joints that do not move any more."""
    model, limits, q = robot.model, robot.limits, robot.q0.copy()
    names = list(model.names)[1:]
    indices: list[int] = []
    gone_q: set[int] = set()
    gone_v: set[int] = set()
    for name, value in locked.items():
        if name not in names:
            raise unknown("joint", name, names, f"of robot {robot.name}")
        index = model.getJointId(name)
        joint = model.joints[index]
        if joint.nv == 0:
            pairs = zip(model.names, model.joints, strict=True)
            leader = next(n for n, j in pairs if j.idx_v == joint.idx_v and j.nv)
            raise DikbenchError(
                f"robot {robot.name}: joint {name!r} follows {leader!r}; lock that one"
            )
        if joint.nv != 1:
            raise DikbenchError(f"robot {robot.name}: joint {name!r} cannot be locked")
        indices.append(index)
        gone_q.update(range(joint.idx_q, joint.idx_q + joint.nq))
        gone_v.add(joint.idx_v)
        if value is not None:
            if joint.nq == 1:
                q[joint.idx_q] = value
            else:
                q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
    # What follows a locked joint is locked with it.
    indices += [
        index
        for index, joint in enumerate(model.joints)
        if joint.idx_v in gone_v and index not in indices
    ]
    position = limits.position
    assert position is not None
    outside = (robot.inside(q) != q)[limits.q_index] & (limits.q_index >= 0)
    for name, value in locked.items():
        k = model.joints[model.getJointId(name)].idx_v
        if outside[k]:
            raise DikbenchError(
                f"robot {robot.name}: lock={name}={value:g} is outside the position limits, "
                f"{position.lower[k]:g} to {position.upper[k]:g}"
            )
    reduced = reduced_model(model, sorted(indices), q)
    kept_q = np.setdiff1d(np.arange(model.nq), list(gone_q))
    kept_v = np.setdiff1d(np.arange(model.nv), list(gone_v))
    if not len(kept_v):
        raise DikbenchError(f"robot {robot.name}: all joints are locked")
    known, visuals = robot.available_acceleration, robot.visuals
    return replace(
        robot,
        model=reduced,
        limits=limits.of_joints(kept_v, kept_q),
        q0=q[kept_q],
        available_acceleration=None if known is None else known[kept_v],
        visuals=visuals and partial(_reduced_visuals, model, visuals, sorted(indices), q),
    )


def _reduced_visuals(model: Any, visuals: Callable[[], Any], locked: list[int], q: Array) -> Any:
    return reduced_geometry(model, visuals(), locked, q)


def _movable_rows(robot: Robot) -> tuple[int, ...]:
    """Find the rows of the task frame's body twist that are not zero in all of some postures."""
    kinematics, random = Kinematics(robot), np.random.default_rng(0)
    most = np.zeros(6)
    for _ in range(POSTURES_LOOKED_AT):
        step = robot.joint_scale * random.uniform(-1, 1, robot.nv)
        kinematics.update(pin.integrate(robot.model, robot.q0, step))
        most = np.maximum(most, np.abs(kinematics.jacobian(robot.frame_id)).max(axis=1))
    return tuple(np.flatnonzero(most > IMMOVABLE).tolist())


def _check_ranges(robot: Robot) -> None:
    """Check that each joint that moves the task frame can move.

    Raises:
        DikbenchError: if the range of one is a single position.
    """
    position = robot.limits.position
    assert position is not None
    stuck = [k for k in robot.chain if position.lower[k] == position.upper[k]]
    if stuck:
        model = robot.model
        joint = next(
            n for n, j in enumerate(model.joints) if n and j.idx_v <= stuck[0] < j.idx_v + j.nv
        )
        raise DikbenchError(
            f"robot {robot.name}: joint {model.names[joint]!r} cannot move: its position limits "
            f"are both {position.lower[stuck[0]] + 0.0:g} (0 where a URDF "
            f"has none); give it limits, or lock it: lock={model.names[joint]}"
        )
