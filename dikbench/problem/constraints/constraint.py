"""A constraint and its linearisation at one configuration: rows G v <= h."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from dikbench.arrays import Array
from dikbench.robots.kinematics import Kinematics


class Constraint(Protocol):
    """A condition on the motion in addition to the joint limits: a frozen dataclass.

    The number of rows is the same at every configuration, so that a solver can keep its workspace.
    """

    def linearize(
        self, kinematics: Kinematics, v_prev: Array | None, dt: float
    ) -> tuple[Array, Array]:
        """Compute the rows G v <= h on the velocity of one control step.

        Args:
            kinematics: at the configuration.
            v_prev: the velocity that the plant applied last, (nv,) [rad/s], or None.
            dt: control period [s].

        Returns:
            G (p, nv), each row of unit length or zero, and h (p,) [rad/s or m/s].
        """
        ...


def linearize_all(
    constraints: Sequence[Constraint], kinematics: Kinematics, v_prev: Array | None, dt: float
) -> tuple[Array | None, Array | None]:
    """Stack the rows of several constraints; return (None, None) where there is none."""
    if not constraints:
        return None, None
    parts = [constraint.linearize(kinematics, v_prev, dt) for constraint in constraints]
    G = parts[0][0] if len(parts) == 1 else np.vstack([rows for rows, _ in parts])
    h = parts[0][1] if len(parts) == 1 else np.concatenate([bounds for _, bounds in parts])
    G.flags.writeable = h.flags.writeable = False
    return G, h


def unit_rows(G: Array, h: Array) -> tuple[Array, Array]:
    """Scale the rows of G v <= h to unit length; leave rows of zeros as they are."""
    length = np.linalg.norm(G, axis=1)
    scale = np.divide(1.0, length, out=np.ones_like(length), where=length > 0)
    return G * scale[:, None], h * scale
