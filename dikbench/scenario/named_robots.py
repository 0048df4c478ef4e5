"""A scenario family that is made for robots of the catalogue, as they are there."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Literal

from dikbench.scenario.family import Family


@dataclass(frozen=True, kw_only=True)
class NamedRobotFamily(Family, ABC):
    """A family whose postures or paths are known for a few robots only, joint by joint.

    What would change their frame, rows or joints is fixed, and hidden. A subclass declares which
    robots these are: `robot: Literal["ur5", "panda"] = "ur5"`.
    """

    frame: None = None
    rows: None = None
    lock: None = None
    root: Literal["fixed"] = "fixed"
