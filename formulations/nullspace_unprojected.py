"""A correction towards the second task without a projection: not a priority."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.problem import (
    Array,
    DikProblem,
    Parameters,
    ProblemPart,
    Range,
    Solve,
    pseudo_inverse,
)


@dataclass(frozen=True)
class NullspaceUnprojected(Parameters):
    """Correct towards each lower task in turn: does NOT protect the first task.

        v_1 = J_1^+ V_1,   v_k = v_(k-1) + J_k^+ (V_k - J_k v_(k-1))

    over the priority levels k = 1, 2, ...; J_k (m_k, nv) and V_k (m_k,) are level k's, poses in the
    task frame; v in rad/s. Lecture notes give it for two levels as a form of null-space projection,
    which it is only where the row spaces of the tasks are orthogonal; otherwise the correction
    disturbs the tasks above. The lowest task is done exactly, so that a posture as the lowest task
    replaces the first one. It is included as a common mistake; ignores limits and weights.

    Attributes:
        rank_tolerance: singular values of J_k up to this count as zero (absolute, units of J_k).

    Source: lecture notes on differential inverse kinematics, "null space projection", first form;
    compare [Chiaverini1997].
    """

    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        v = np.zeros(problem.robot.nv)
        for level in problem.levels:
            missing = level.V - level.J.dot(v)
            v = v + pseudo_inverse(level.J, self.rank_tolerance).dot(missing)
        return v
