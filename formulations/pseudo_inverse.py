"""Resolved rate control with the pseudo-inverse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Interval,
    LimitKind,
    Parameters,
    Range,
    Solve,
    least_norm,
)


@dataclass(frozen=True)
class PseudoInverse(Parameters):
    """Resolved-rate control: the least-norm velocity that does the task.

        v = J^+ V,   then   none:  v
                            clip:  min(max(v, v_min), v_max) joint by joint
                            scale: s v with the largest s <= 1 inside the velocity limits

    J (m, nv) and V (m,) are the primary task's, in the task frame; v in rad/s. Exact where the task
    is feasible, unbounded near a singularity; clipping causes direction errors, scaling slows
    down. Ignores weights.

    Attributes:
        after: what to do with a velocity outside the limits.
        rank_tolerance: singular values up to this count as zero (absolute, units of J).

    Source: [Whitney1969].
    """

    after: Literal["none", "clip", "scale"] = "none"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    @property
    def keeps(self) -> frozenset[LimitKind]:
        """The velocity limits, unless nothing is done after the inverse."""
        return frozenset() if self.after == "none" else frozenset({"velocity"})

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        v = least_norm(task.J, task.V, self.rank_tolerance)
        limit = problem.limits.joint.velocity
        if self.after == "none" or limit is None:
            return v
        return np.clip(v, limit.lower, limit.upper) if self.after == "clip" else scaled(v, limit)


def scaled(v: Array, limit: Interval) -> Array:
    """Scale v (nv,), or each of (N, nv), by the largest s <= 1 that keeps it inside the limits."""
    shorter: Array = v / np.maximum(1.0, limit.usage(v).max(axis=-1, keepdims=True))
    return shorter
