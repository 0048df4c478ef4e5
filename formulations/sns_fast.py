"""Saturation in the null space, by updates of rank one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from dikbench.errors import Infeasible
from dikbench.problem import (
    Array,
    Box,
    Braking,
    DikProblem,
    LimitKind,
    LinearizedTask,
    Parameters,
    ProblemPart,
    Range,
    Solve,
    inverse_and_row_space,
)
from formulations.saturation import SMALLEST_SQUARED_FREEDOM, fitting_scale, inside


@dataclass(frozen=True)
class FastSaturationInNullSpace(Parameters):
    """Saturation in the null space with one inverse per task.

        a = J^+ V,  b = 0,  Z = I - J^+ J;   hold joint j at its bound:  z = Z e_j / (e_j^T Z e_j),
        a := a - z a_j,   b := b + z (bound_j - b_j),   Z := Z - z e_j^T Z,   v = s a + b

    The joints are held in the order of `sns`, and for one task of full rank the motion is that of
    `sns`, at the price of an outer product per joint held. It differs elsewhere: the levels below
    start from Z, so that a joint that a level holds is held for all below it; a task that has lost
    a rank is scaled, no joint is held for it.

    J (m, nv) and V (m,) are each priority level's, poses in the task frame; v in rad/s. Strict
    priority; no direction error and inside every limit. Starts again from v_prev where the box
    excludes rest, as `sns` does. `Infeasible` where no s fits. Ignores weights.

    Attributes:
        braking: how the box approaches a position limit (see `dikbench.problem.velocity_box`).
        rank_tolerance: singular values of J N up to this count as zero (absolute, units of J).

    Source: [Flacco2015], the fast version, as in its authors' program sns_ik.
    """

    braking: Braking = "viable"
    rank_tolerance: Annotated[float, Range(0.0)] = 1e-6

    keeps: ClassVar[frozenset[LimitKind]] = frozenset({"position", "velocity", "acceleration"})
    sees: ClassVar[frozenset[ProblemPart]] = frozenset({"lower-tasks"})

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        box = problem.box(self.braking)
        v, N = np.zeros(problem.robot.nv), np.eye(problem.robot.nv)
        for number, level in enumerate(problem.levels):
            found = self._saturated(level, v, N, box)
            if found is None and number == 0 and problem.v_prev is not None:
                found = self._saturated(level, inside(problem.v_prev, box), N, box)
            if found is not None:
                v, N = found
            elif number == 0:
                raise Infeasible("saturation in the null space: no scale of the task fits the box")
        return v

    def _saturated(
        self, level: LinearizedTask, start: Array, N: Array, box: Box
    ) -> tuple[Array, Array] | None:
        """Find the velocity of a level, (nv,), and what it leaves free, (nv, nv); or None."""
        J = level.J
        inverse, rows = inverse_and_row_space(J @ N, self.rank_tolerance)
        a, b = inverse @ level.V, start - inverse @ (J @ start)
        Z = N - rows.T @ rows
        held: list[int] = []
        best, best_scale = None, -1.0
        while True:
            scale, critical = fitting_scale(a, b, box, held)
            if scale > best_scale:
                best, best_scale = (inside(b + scale * a, box), Z), scale
            if (
                critical is None
                or len(rows) < len(J)
                or Z[critical, critical] <= (SMALLEST_SQUARED_FREEDOM)
            ):
                return best
            bound = (box.upper if a[critical] + b[critical] > box.upper[critical] else box.lower)[
                critical
            ]
            z = Z[:, critical] / Z[critical, critical]
            a, b = a - z * a[critical], b + z * (bound - b[critical])
            Z = Z - np.outer(z, Z[critical])
            held.append(critical)
