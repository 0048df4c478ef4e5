"""Target poses from a user's CSV file."""

from __future__ import annotations

import codecs
import csv
import math
import os.path
import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal, DecimalException
from io import StringIO
from itertools import zip_longest
from typing import Any, Final

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError

POSE_COLUMNS: Final = ("t", "x", "y", "z", "qx", "qy", "qz", "qw")

SEPARATORS: Final = (",", ";", "\t")

DECIMAL_COMMA: Final = re.compile(r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$")
"""A number such as 0,5 or -1,5e-3."""

COMMENT: Final = "#"
"""A line that begins with it is no row; it may hold the header, as numpy.savetxt writes it."""

QUATERNION_NORM_TOLERANCE: Final = 1e-3
"""Largest error of a quaternion's norm, which comes from rounded digits."""

SHORTEST_SPAN_S: Final = 1e-9
"""Least time between two rows."""

LONGEST_QUOTE: Final = 80
"""So many characters of a header are quoted."""

FARTHEST_M: Final = 1e6
"""Coordinates beyond it are mistakes."""


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

    Columns may be in any order, others are ignored; commas, semicolons or tabs separate them, and
    between the latter two 0,5 is 0.5. Lines that are empty or begin with # are no rows. Times count
    from the first row, which is subtracted in decimal digits: stamps of a clock, such as
    1700000000.02, lose none. The text is UTF-8, UTF-16 with its mark, or else Latin-1.

    Raises:
        DikbenchError: if the file, a column or a value is missing, a column stands twice, a row has
            more values than there are columns, a value is not a finite number, times do not
            increase by a nanosecond at least, a quaternion is not of unit norm, or there are fewer
            than two rows.
    """
    if not os.path.isfile(path):
        raise DikbenchError(f"pose file not found: {path}")
    start, before = Decimal(0), ""
    times: list[float] = []
    placements: list[Any] = []
    lines: list[int] = []
    try:
        for line, row in _rows(path):
            where, stamp = f"pose file {path}, line {line}", row["t"]
            time = _decimal(stamp, where)
            start = start if times else time
            t = float(time - start)
            if times and t <= times[-1]:
                raise DikbenchError(f"{where}: t={stamp} must be above {before} before it")
            if times and t - times[-1] < SHORTEST_SPAN_S:
                raise DikbenchError(f"{where}: t={stamp} is less than 1 ns after {before}")
            before = stamp
            times.append(t)
            pose = [_number(row[name], name, where) for name in POSE_COLUMNS[1:]]
            placements.append(_placement(pose, where))
            lines.append(line)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DikbenchError(f"pose file {path} is not a CSV file: {error}") from None
    if len(times) < 2:
        raise DikbenchError(f"pose file {path}: {len(times)} rows of poses; at least 2 are needed")
    return PoseFile(tuple(times), tuple(placements), tuple(lines))


def _rows(path: str) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield the number of the line of each row, and its values by column."""
    header: list[str] = []
    separator = SEPARATORS[0]
    for line, text in enumerate(StringIO(_text(path), newline=None), start=1):
        where = f"pose file {path}, line {line}"
        text = text.strip("\n")
        comment = text.lstrip().startswith(COMMENT)
        if not text.strip() or (comment and header):
            continue
        if header:
            cells = _cells(text, separator)
            if any(cells[len(header) :]):
                raise DikbenchError(
                    f"{where}: {len(cells)} values; the header has {len(header)} columns"
                    + (" (numbers such as 0,5 need ; between them)" if separator == "," else "")
                )
            if separator != ",":
                cells = [DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
            yield line, dict(zip_longest(header, cells[: len(header)], fillvalue=""))
            continue
        separator = max(SEPARATORS, key=text.count)
        names = _cells(text.lstrip(f"{COMMENT} ") if comment else text, separator)
        if not comment or set(POSE_COLUMNS) <= set(names):
            _check_header(names, text, path)
            header = names
    if not header:
        _check_header([], "", path)


def _text(path: str) -> str:
    """Read a text; of one that is not Unicode, names and numbers are the same in Latin-1."""
    with open(path, "rb") as file:
        content = file.read()
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _cells(text: str, separator: str) -> list[str]:
    """Split a line into its values."""
    return [cell.strip() for cell in next(csv.reader([text], delimiter=separator))]


def _check_header(names: list[str], text: str, path: str) -> None:
    """Check that each column is there once; a line that lacks one is quoted."""
    said = f"; the header is {text[:LONGEST_QUOTE]!r}" if text else ""
    for name in POSE_COLUMNS:
        if name not in names:
            expected = ",".join(POSE_COLUMNS)
            raise DikbenchError(f"pose file {path}: no column {name!r}; expected: {expected}{said}")
        if names.count(name) > 1:
            raise DikbenchError(f"pose file {path}: column {name!r} stands twice{said}")


def _number(text: str, name: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DikbenchError(f"{where}: {name}={text!r} is not a finite number")
    return value


def _decimal(stamp: str, where: str) -> Decimal:
    _number(stamp, "t", where)
    try:
        return Decimal(stamp)
    except DecimalException:  # an exponent of twenty digits
        raise DikbenchError(f"{where}: t={stamp!r} is not a finite number") from None


def _placement(pose: list[float], where: str) -> Any:
    for name, value in zip(POSE_COLUMNS[1:4], pose, strict=False):
        if abs(value) > FARTHEST_M:
            raise DikbenchError(f"{where}: {name}={value:g} must be within {FARTHEST_M:g} m")
    quaternion = np.array(pose[3:])
    norm = math.hypot(*pose[3:])
    if abs(norm - 1) > QUATERNION_NORM_TOLERANCE:
        raise DikbenchError(
            f"{where}: the quaternion's norm is {norm:.4g}, it must be 1 to within "
            f"{QUATERNION_NORM_TOLERANCE:g}"
        )
    return pin.SE3(pin.Quaternion(quaternion / norm).matrix(), np.array(pose[:3]))
