"""The robots that are known by name, and robots from a user's URDF."""

from __future__ import annotations

import importlib.metadata
import os.path
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.captured_stderr import captured_stderr
from dikbench.errors import DikbenchError, unknown
from dikbench.planar_arm import planar_arm
from dikbench.robot import Robot, checked_vector, frame_id, model_limits

UR_START = (0.3, -1.2, 1.4, -1.7, -1.4, 0.2)
UR_BRAKING = (
    "joint speed limit over 0.5 s, the braking ramp that the safety system enforces "
    "(UR10/CB3 user manual, safety inputs)"
)


@dataclass(frozen=True)
class CatalogueEntry:
    """What must be known of a robot beyond its model file.

    Attributes:
        summary: one line for `dikbench list robots`.
        model: builds the Pinocchio model.
        frame: the default task frame.
        start: a safe start, away from limits and singularities [rad].
        acceleration: acceleration limits, (nv,) [rad/s^2] (no model file carries any), or None.
        acceleration_source: where they come from.
        task_rows: see `Robot`.
    """

    summary: str
    model: Callable[[], Any]
    frame: str
    start: tuple[float, ...]
    acceleration: tuple[float, ...] | None
    acceleration_source: str
    task_rows: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


def _data_folder() -> Path:
    try:
        distribution = importlib.metadata.distribution("example-robot-data")
    except importlib.metadata.PackageNotFoundError:
        raise DikbenchError(
            "example-robot-data is not installed: pip install example-robot-data"
        ) from None
    for file in distribution.files or ():
        if file.parts[-4:-2] == ("robots", "panda_description"):
            return Path(str(file.locate())).parents[2]
    raise DikbenchError("example-robot-data is installed but holds no robots/panda_description")


def _from_data(path: str, locked: tuple[str, ...] = ()) -> Callable[[], Any]:
    def build() -> Any:
        model = pin.buildModelFromUrdf(str(_data_folder() / path))
        if not locked:
            return model
        return pin.buildReducedModel(
            model, [model.getJointId(name) for name in locked], pin.neutral(model)
        )

    return build


ROBOTS: Mapping[str, CatalogueEntry] = MappingProxyType(
    {
        "panda": CatalogueEntry(
            summary="Franka Emika Panda, 7 joints, fingers locked",
            model=_from_data(
                "panda_description/urdf/panda.urdf",
                locked=("panda_finger_joint1", "panda_finger_joint2"),
            ),
            frame="panda_hand_tcp",
            start=(0, -pi / 4, 0, -3 * pi / 4, 0, pi / 2, pi / 4),
            acceleration=(15, 7.5, 10, 12.5, 15, 20, 20),
            acceleration_source="Franka Control Interface, joint limits of the Panda",
        ),
        "ur5": CatalogueEntry(
            summary="Universal Robots UR5, 6 joints, spherical-like wrist",
            model=_from_data("ur_description/urdf/ur5_robot.urdf"),
            frame="tool0",
            start=UR_START,
            acceleration=(6.3, 6.3, 6.3, 6.4, 6.4, 6.4),
            acceleration_source=UR_BRAKING,
        ),
        "ur10": CatalogueEntry(
            summary="Universal Robots UR10, 6 joints, the UR5's longer sister",
            model=_from_data("ur_description/urdf/ur10_robot.urdf"),
            frame="tool0",
            start=UR_START,
            acceleration=(4.32, 4.32, 6.3, 6.4, 6.4, 6.4),
            acceleration_source=UR_BRAKING,
        ),
        "xarm7": CatalogueEntry(
            summary="UFACTORY xArm7, 7 joints; its zero posture is singular",
            model=_from_data("xarm_description/urdf/xarm7.urdf"),
            frame="link_eef",
            start=(0, -0.5, 0, 1.0, 0, 1.3, 0),
            acceleration=(20,) * 7,
            acceleration_source="UFACTORY xArm SDK, joint acceleration at most 20 rad/s^2",
        ),
        "planar3r": CatalogueEntry(
            summary="a planar arm of three links (0.4, 0.3, 0.2 m), built in code",
            model=lambda: planar_arm((0.4, 0.3, 0.2), velocity_limit=2.0),
            frame="tip",
            start=(0.3, 1.6, 0.6),
            acceleration=(10.0, 10.0, 10.0),
            acceleration_source="chosen for this arm, which exists in code only",
            task_rows=(0, 1, 5),
        ),
    }
)


def load_robot(name_or_urdf: str, frame: str | None = None, *, start: object = None) -> Robot:
    """Load a robot by name, or any URDF file together with the name of its task frame.

    Position, velocity and effort limits are the model's; effort and acceleration limits are known
    but not in force (see `Robot.with_limits`).

    Args:
        name_or_urdf: a name of `dikbench list robots`, or the path of a URDF file.
        frame: the task frame; default: the catalogue's. A URDF has no default.
        start: the safe start, shape (nq,) [rad]; default: the catalogue's, for a URDF the
            best-conditioned of a few dozen seeded postures inside the limits.

    Raises:
        DikbenchError: on an unknown robot or frame, a file that is missing or does not parse, or a
            start outside the limits.
    """
    text = str(name_or_urdf)
    if text in ROBOTS:
        robot = _load_named(text)
    elif text.endswith((".urdf", ".xml")) or "/" in text or os.path.isfile(text):
        robot = _load_urdf(text, frame)
    else:
        raise unknown("robot", text, ROBOTS, "(or give the path of a .urdf file)")
    if frame is not None and frame != robot.frame:
        frame_id(robot.model, frame)
        robot = replace(robot, frame=frame)
    if start is None:
        return robot
    q0 = checked_vector(start, robot.nq, f"start of {text}")
    limits = robot.limits.at(q0)
    assert limits.to_lower is not None
    assert limits.to_upper is not None
    if np.any(limits.to_lower < 0) or np.any(limits.to_upper < 0):
        raise DikbenchError(f"start of {text}: {q0.tolist()} is outside the position limits")
    return replace(robot, q0=q0)


@lru_cache
def _load_named(name: str) -> Robot:
    entry = ROBOTS[name]
    model = entry.model()
    model.name = name
    limits = model_limits(model).with_interval("effort", None)
    acceleration = None if entry.acceleration is None else np.array(entry.acceleration, dtype=float)
    q0 = np.array(entry.start, dtype=float)
    return Robot(name, model, entry.frame, limits, q0, entry.task_rows, acceleration)


def _load_urdf(path: str, frame: str | None) -> Robot:
    if not os.path.isfile(path):  # unlike Path.is_file, False for a name that is too long
        raise DikbenchError(f"robot file not found: {path}")
    with captured_stderr() as complaints:
        try:
            model = pin.buildModelFromUrdf(path)
        except (ValueError, RuntimeError) as error:
            reason = " ".join(f"{error} {complaints()}".split())
            raise DikbenchError(
                f"robot file {path} is not a URDF that Pinocchio reads: {reason}"
            ) from None
    if model.nv == 0:
        raise DikbenchError(f"robot file {path}: the model has no moving joint")
    if frame is None:
        frames = ", ".join(f.name for f in model.frames if f.name != "universe")
        raise DikbenchError(f"robot file {path}: name its task frame; valid: {frames}")
    limits = model_limits(model).with_interval("effort", None)
    name = Path(path).stem
    return Robot(name, model, frame, limits, _well_conditioned_start(model, frame))


def _well_conditioned_start(model: Any, frame: str) -> Array:
    """The posture with the largest smallest singular value among a few dozen inside the limits."""
    data, index = model.createData(), frame_id(model, frame)
    limits = model_limits(model)
    assert limits.position is not None
    lower = np.maximum(limits.position.lower, -pi)
    upper = np.minimum(limits.position.upper, pi)
    middle, half = (lower + upper) / 2, (upper - lower) / 2
    neutral = pin.neutral(model)
    random = np.random.default_rng(0)
    best, best_sigma = neutral, -1.0
    for sample in range(64):
        spread = 0.0 if sample == 0 else 0.6
        x = middle + spread * half * random.uniform(-1, 1, model.nv)
        q = pin.integrate(model, neutral, x)
        q[limits.q_index] = np.where(np.isfinite(limits.position.upper), x, q[limits.q_index])
        J = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL)
        sigma = np.linalg.svd(J, compute_uv=False)[min(6, model.nv) - 1]
        if sigma > best_sigma:
            best, best_sigma = q, float(sigma)
    start: Array = best
    return start
