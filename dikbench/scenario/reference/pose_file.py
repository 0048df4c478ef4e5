"""Target poses from a user's CSV file."""

from __future__ import annotations

import csv
import math
import os.path
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError

POSE_COLUMNS: Final = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")

QUATERNION_NORM_TOLERANCE: Final = 1e-3
"""Largest error of a quaternion's norm, which comes from rounded digits."""


@dataclass(frozen=True, eq=False)
class PoseFile:
    """Placements at increasing times.

    Attributes:
        times: times from 0 on [s].
        placements: one per time (`pinocchio.SE3`).
        lines: the line of the file of each.
    """

    times: tuple[float, ...]
    placements: tuple[Any, ...]
    lines: tuple[int, ...]


def read_poses(path: str) -> PoseFile:
    """Read a CSV file with the columns t [s], x, y, z [m], qx, qy, qz, qw (unit quaternion).

    Columns may be in any order, others are ignored. Times count from the first row.

    Raises:
        DikbenchError: if the file, a column or a value is missing, a value is not a finite number,
            times do not increase, a quaternion is not of unit norm, or there are fewer than two
            rows.
    """
    if not os.path.isfile(path):
        raise DikbenchError(f"pose file not found: {path}")
    times: list[float] = []
    placements: list[Any] = []
    lines: list[int] = []
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            rows = csv.DictReader(file, skipinitialspace=True)
            missing = [name for name in POSE_COLUMNS if name not in (rows.fieldnames or ())]
            if missing:
                expected = ",".join(POSE_COLUMNS)
                raise DikbenchError(
                    f"pose file {path}: no column {missing[0]!r}; expected: {expected}"
                )
            for row in rows:
                where = f"pose file {path}, line {rows.line_num}"
                t, *pose = (_number(row[name], name, where) for name in POSE_COLUMNS)
                if times and t <= times[-1]:
                    raise DikbenchError(f"{where}: t={t:g} must be above {times[-1]:g} before it")
                times.append(t)
                placements.append(_placement(pose, where))
                lines.append(rows.line_num)
    except (UnicodeDecodeError, csv.Error) as error:
        raise DikbenchError(f"pose file {path} is not a CSV file: {error}") from None
    if len(times) < 2:
        raise DikbenchError(f"pose file {path}: {len(times)} rows of poses; at least 2 are needed")
    return PoseFile(tuple(t - times[0] for t in times), tuple(placements), tuple(lines))


def _number(text: str | None, name: str, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DikbenchError(f"{where}: {name}={text or ''!r} is not a finite number")
    return value


def _placement(pose: list[float], where: str) -> Any:
    quaternion = np.array(pose[3:])
    norm = float(np.linalg.norm(quaternion))
    if abs(norm - 1) > QUATERNION_NORM_TOLERANCE:
        raise DikbenchError(f"{where}: the quaternion's norm is {norm:.4g}, it must be 1")
    return pin.SE3(pin.Quaternion(quaternion / norm).matrix(), np.array(pose[:3]))
