"""The results of rechecking a run's answers, per control step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from dikbench.arrays import Array, Indices, Mask
from dikbench.programs.answer import Answer
from dikbench.programs.modelled_program import ModelledProgram
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.recheck.optimum import distance_to_optimum
from dikbench.solvers.recheck.residuals import residuals
from dikbench.solvers.recheck.stack import Stack, structure

LARGEST_VERIFIED_DISTANCE: Final = 1e-2
"""Largest distance of a verified answer from the optimum [rad/s; alpha for alpha scaling]."""

NO_PROGRAM: Final = -1
"""The value of `claimed` and `verified` at a step at which nothing was solved."""

Solved = tuple[int, QuadraticProgram | ModelledProgram, Answer]
"""Number of the step, the program, and the answer."""

_Answered = tuple[int, QuadraticProgram, Answer]


class RecheckedSteps:
    """The results of the recheck at each of n control steps, (n,) each.

    Attributes:
        claimed: 1 if the solver claimed to have solved every program, 0 if not, -1 if there was
            none.
        lied: whether the solver claimed an answer that is not within tolerance.
        verified: 1 if every answer is within tolerance, 0 if not, -1 if there was none.
        primal, dual, gap: the largest residuals of the step (see `Residuals`); NaN where one is
            not known.
        distance: largest distance from the optimum (see `distance_to_optimum`); NaN where it is
            not known.
    """

    __slots__ = ("claimed", "distance", "dual", "gap", "lied", "primal", "verified")

    def __init__(self, steps: int) -> None:
        self.claimed: Indices = np.full(steps, NO_PROGRAM)
        self.verified: Indices = np.full(steps, NO_PROGRAM)
        self.lied: Mask = np.zeros(steps, dtype=bool)
        self.primal: Array = np.zeros(steps)
        self.dual: Array = np.zeros(steps)
        self.gap: Array = np.zeros(steps)
        self.distance: Array = np.zeros(steps)

    def recheck(self, solved: Sequence[Solved], tolerance: float) -> None:
        """Recheck answers and record the results at their steps.

        Args:
            solved: programs and answers of steps that were not rechecked before.
            tolerance: largest residual of a verified answer.
        """
        if not solved:
            return
        steps = np.array([step for step, _, _ in solved])
        self.claimed[steps] = np.abs(self.claimed[steps])
        np.minimum.at(self.claimed, steps, [int(answer.claimed) for _, _, answer in solved])
        self.verified[steps] = np.abs(self.verified[steps])
        groups: dict[tuple[object, ...], list[_Answered]] = {}
        for step, given, answer in solved:
            if answer.x is None:
                self.verified[step] = 0
                self.lied[step] |= answer.claimed
                continue
            program = given.matrices() if isinstance(given, ModelledProgram) else given
            groups.setdefault(structure(program, answer), []).append((step, program, answer))
        for group in groups.values():
            self._recheck_group(group, tolerance)

    def _recheck_group(self, group: list[_Answered], tolerance: float) -> None:
        steps, programs, answers = (list(column) for column in zip(*group, strict=True))
        stack = Stack(programs, answers)
        with np.errstate(invalid="ignore", over="ignore"):  # an answer may not be finite
            found = residuals(stack)
            distance = distance_to_optimum(programs, answers, found.nearness)
            np.maximum.at(self.primal, steps, found.primal)
            np.maximum.at(self.dual, steps, found.dual)  # NaN where unknown
            np.maximum.at(self.gap, steps, found.gap)
            np.maximum.at(self.distance, steps, distance)
        good = np.isfinite(stack.x).all(axis=1) & found.within(tolerance)
        good &= ~(distance > LARGEST_VERIFIED_DISTANCE)
        np.minimum.at(self.verified, steps, good.astype(int))
        np.logical_or.at(self.lied, steps, ~good & [answer.claimed for answer in answers])
