"""Names beside points: each where it covers neither a point nor another name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.report.drawing.style import lay_out

RADII: Final = (5.5, 9.0, 14.0, 20.0, 28.0, 38.0, 50.0, 66.0, 85.0)
"""Distances from the point at which room is looked for [pt], ..."""

ANGLES: Final = (0, 180, 45, -45, 135, -135, 90, -90, 20, -20, 160, -160, 68, -68, 112, -112)
"""... and in which directions [deg]."""

LEADER: Final = 8.0
"""From this distance on a line leads from the point to its name [pt]."""

SAMPLES: Final = np.linspace(0.0, 1.0, 12)
"""Places along such a line at which it is held against names and points."""


def label_points(
    axis: Any, points: Array, names: Sequence[str], colours: Sequence[str], size: float = 6.5
) -> str:
    """Write the names of points (k, 2) beside them, those in the thick of it first.

    Everything else in the figure must be there already: it is laid out.

    Returns:
        A sentence about the names for which there was no room, which are left out.
    """
    figure = axis.figure
    lay_out(figure)
    pixel = figure.dpi / 72.0
    places = axis.transData.transform(points) / pixel
    frame = np.array(axis.get_window_extent().extents) / pixel
    taken = [np.array([x - 2.5, y - 2.5, x + 2.5, y + 2.5]) for x, y in places]
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    crowding = np.sort(distances, axis=1)[:, : min(5, len(places))].mean(axis=1)
    left_out = []
    for index in np.argsort(crowding, kind="stable"):
        text = axis.annotate(
            names[index], points[index], xytext=(0, 0), textcoords="offset points", fontsize=size,
            color=colours[index], ha="center", va="center", in_layout=False, zorder=2,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.3},
        )  # fmt: skip
        extent = text.get_window_extent().extents / pixel  # its box is not in it
        half = np.array([extent[2] - extent[0], extent[3] - extent[1]]) / 2.0
        offset = _room(places[index], half, taken, frame)
        if offset is None:
            text.remove()
            left_out.append(names[index])
            continue
        text.set_position(tuple(offset))
        middle = places[index] + offset
        taken.append(np.concatenate([middle - half, middle + half]))
        nearest = _leader(offset, half)
        if np.linalg.norm(nearest) > LEADER:
            along = places[index] + SAMPLES[:, None] * nearest
            taken.extend(np.concatenate([along, along], axis=1))  # no later name covers the line
            axis.annotate(
                "", points[index], xytext=tuple(nearest), textcoords="offset points",
                in_layout=False, zorder=2,
                arrowprops={
                    "arrowstyle": "-", "color": "0.6", "linewidth": 0.5, "shrinkA": 0, "shrinkB": 2
                },
            )  # fmt: skip
    return f" There was no room for the names of {', '.join(sorted(left_out))}." if left_out else ""


def _leader(offset: Array, half: Array) -> Array:
    """From a point to the nearest place of a name, whose middle is at an offset from the point."""
    return np.clip(np.zeros(2), offset - half, offset + half)


def _room(place: Array, half: Array, taken: Sequence[Array], frame: Array) -> Array | None:
    """The offset of a name's middle at which it is free, nearest first."""
    boxes = np.array(taken)
    for radius in RADII:
        for angle in np.radians(ANGLES):
            way = np.array([np.cos(angle), np.sin(angle)])
            offset: Array = way * radius + way * half
            low, high = place + offset - half, place + offset + half
            inside = np.all(low >= frame[:2]) and np.all(high <= frame[2:])
            hits = np.all((low < boxes[:, 2:]) & (high > boxes[:, :2]), axis=1)
            if not inside or hits.any():
                continue
            leader = _leader(offset, half)
            if np.linalg.norm(leader) > LEADER:
                line = place + SAMPLES[2:-1, None, None] * leader  # past the point itself
                if np.any(np.all((line > boxes[:, :2]) & (line < boxes[:, 2:]), axis=2)):
                    continue
            return offset
    return None
