"""Joint centring by gradient projection."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from dikbench.problem import (
    Array,
    DampedInverse,
    DikProblem,
    Drawn,
    Limits,
    Parameters,
    Projector,
    Range,
    Solve,
)


@dataclass(frozen=True)
class JointCentering(Parameters):
    """Joint centring: do the task, and move the joints towards the middle of their range.

        v = J^# V + (I - J^+ J) v_2   (exact)   or   J^# V + (I - J^# J) v_2   (damped)
        v_2 = -k (q - q_mid),  q_mid = (q_min + q_max) / 2

    joint by joint, 0 for a joint without both limits; J (m, nv) and V (m,) are the primary
    task's, in the task frame; J^# = J^T (J J^T + lambda^2 I)^-1; v in rad/s. Stays away from the
    joint limits as far as the null space allows, but does not keep them. Ignores other tasks and
    weights: for another posture use `nullspace` with a posture task.

    Attributes:
        gain: k [1/s].
        damping: lambda, unsquared (units of J); 0 by default: the task exactly.
        projector: whether the null-space projector is exact or damped; damped, centring disturbs
            the task.
        rank_tolerance: singular values of J up to this count as zero (absolute, units of J).

    Source: [Liegeois1977].
    """

    gain: Annotated[float, Range(0.0, unit="1/s"), Drawn(0.1, 10.0, log=True)] = 1.0
    damping: Annotated[float, Range(0.0), Drawn(1e-3, 0.3, log=True)] = 0.0
    projector: Projector = "exact"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        inverse = DampedInverse(task.J, self.rank_tolerance, self.damping)
        v = inverse.times(task.V)
        to_middle = distance_to_middle(problem.limits)
        if to_middle is None:
            return v
        centring = self.gain * to_middle
        v += centring - inverse.taken(self.projector).dot(centring)
        return v


def distance_to_middle(limits: Limits) -> Array | None:
    """Compute q_mid - q, (nv,) [rad or m]; 0 without both limits, None if none is in force."""
    if limits.joint.middle is None or limits.coordinates is None:
        return None
    distance: Array = limits.joint.middle - limits.coordinates
    distance[np.isnan(distance)] = 0.0
    return distance
