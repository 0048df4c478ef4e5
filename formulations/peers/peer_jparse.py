"""The authors' J-PARSE itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar

import numpy as np
import pinocchio as pin

from dikbench.problem import Array, DikProblem, Drawn, Range, Robot, Solve
from formulations.peers.models import check_same, in_body_axes
from formulations.peers.peer import WITH_PEERS, Peer


@dataclass(frozen=True)
class PeerJParse(Peer):
    """J-PARSE by its authors' package: `Robot.jparse(q)` times the twist, in the world's axes.

    Both singular gains are 1, the package's default; it knows no limits.

    Attributes:
        threshold: gamma, the share of the largest singular value up to which a direction counts as
            nearly lost; the package's default is 0.1.

    Source: [Guptasarma2025], package jparse-robotics.
    """

    threshold: Annotated[float, Range(above=0.0, below=1.0), Drawn(0.01, 0.5, log=True)] = 0.1

    requires: ClassVar[Mapping[str, str]] = MappingProxyType({"jparse_robotics": WITH_PEERS})
    package: ClassVar[str] = "jparse-robotics"
    every_row: ClassVar[bool] = True

    @property
    def counterpart(self) -> str:
        """See `Peer`."""
        return f"jparse[threshold={self.threshold}]"

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        V = problem.primary.V
        inverse, R = _set_up(problem.robot, self.threshold)(problem.q)
        v: Array = inverse @ np.concatenate([R @ V[:3], R @ V[3:]])
        return v


class _JParse:
    """The package's robot, of our Pinocchio model."""

    def __init__(self, robot: Robot, threshold: float) -> None:
        from jparse_robotics import Robot as Theirs

        self._data, self._frame = robot.model.createData(), robot.frame_id
        self._theirs: Any = Theirs(robot.model, self._data, robot.frame_id, threshold)
        check_same(robot, "jparse-robotics", self._at)

    def __call__(self, q: Array) -> tuple[Array, Array]:
        """Compute its inverse (nv, 6), in the world's axes, and the frame's rotation (3, 3)."""
        inverse = self._theirs.jparse(q)
        return inverse, self._data.oMf[self._frame].rotation

    def _at(self, q: Array) -> tuple[Array, Array]:
        J = self._theirs.jacobian(q)
        X: pin.SE3 = self._data.oMf[self._frame]
        return X.homogeneous, in_body_axes(X.rotation, J)


@lru_cache(maxsize=4)
def _set_up(robot: Robot, threshold: float) -> _JParse:
    return _JParse(robot, threshold)
