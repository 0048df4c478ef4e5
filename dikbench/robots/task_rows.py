"""The rows of the task frame's twist that a robot is asked for, and their axes."""

from __future__ import annotations

import re
from typing import Final, Literal

from dikbench.errors import DikbenchError

Axes = Literal["body", "world"]
"""The axes in which rows of a twist are counted: those of the task frame, or the world's."""

ALL_ROWS: Final = (0, 1, 2, 3, 4, 5)
"""The rows of a pose: the linear part along x, y, z, then the angular part about them."""

PLANE_ROWS: Final = (0, 1, 5)
"""The rows of a pose in the x-y plane."""

_NAMES: Final = ("x", "y", "z", "rx", "ry", "rz")
_FORM: Final = re.compile(r"(world:)?((?:r?[xyz])+)")


def parsed_rows(text: object) -> tuple[tuple[int, ...], Axes]:
    """Read rows such as `xyz` (position), `rxryrz` (orientation) or `world:xyrz`.

    Letters x, y, z stand for the linear rows, rx, ry, rz for the angular ones, counted in the axes
    of the task frame, after `world:` in the world's.

    Raises:
        DikbenchError: if the text has another form, or names a row twice.
    """
    match = _FORM.fullmatch(text.replace(" ", "")) if isinstance(text, str) else None
    names = re.findall("r?[xyz]", match[2]) if match else []
    if match is None or len(set(names)) < len(names):
        raise DikbenchError(
            f"rows={text!r} is not valid; valid: x, y, z, rx, ry, rz in a row, each at most once "
            "(xyz: the position; rxryrz: the orientation), after world: in the world's axes"
        )
    return tuple(sorted(_NAMES.index(name) for name in names)), "world" if match[1] else "body"


def rows_in_words(rows: tuple[int, ...], axes: Axes) -> str:
    """Write rows as `parsed_rows` reads them."""
    return ("world:" if axes == "world" else "") + "".join(_NAMES[row] for row in rows)
