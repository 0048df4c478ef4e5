"""Robots by name: those of the catalogue, then those of other authors."""

from __future__ import annotations

from typing import Any, Final

from dikbench.robots.catalogue import ROBOTS, CatalogueEntry
from dikbench.user_code import Pluggable


def misfit(value: Any) -> str:
    """Say why something is no robot, to follow its name; an empty text where it is one."""
    if isinstance(value, CatalogueEntry):
        return ""
    return "is no dikbench.robots.CatalogueEntry"


EVERY_ROBOT: Final = Pluggable("robot", ROBOTS, misfit)
"""Where robots are looked for by their names."""


def robot_entry(name: str) -> CatalogueEntry:
    """Find a robot by its name or by `path/to/file.py:NAME`.

    Raises:
        DikbenchError: if there is no such robot, or what has the name is none.
    """
    found = EVERY_ROBOT.find(name)
    if found is None:
        return ROBOTS[name]
    entry: CatalogueEntry = found.value
    return entry
