"""How far an answer is from solving its program, recomputed by us."""

from __future__ import annotations

from typing import Final

import numpy as np

from dikbench.array import Array
from dikbench.quadratic_program import QuadraticProgram
from dikbench.solvers.answer import Answer

VERIFIED_TOLERANCE: Final = 1e-3
"""The largest residual of a verified answer: primal in rad/s and m/s, dual and gap as scaled."""


class Residuals:
    """Residuals of an answer.

    Attributes:
        primal: largest violation of an equality, inequality or bound [rad/s, m/s].
        dual: largest entry of P x + q + G^T z + A^T y + z_box, and largest multiplier of the wrong
            sign, over max(1, largest entry of P), a gradient of the cost; NaN where the interface
            gives no multipliers.
        gap: |x^T P x + q^T x + h^T z + b^T y + ub^T z_box+ + lb^T z_box-|, on the same scale.
    """

    __slots__ = ("dual", "gap", "primal")

    def __init__(self, primal: float, dual: float, gap: float) -> None:
        self.primal = primal
        self.dual = dual
        self.gap = gap

    @property
    def verified(self) -> bool:
        """Whether every residual that is known is within tolerance."""
        return not any(r > VERIFIED_TOLERANCE for r in (self.primal, self.dual, self.gap))


def residuals(program: QuadraticProgram, answer: Answer) -> Residuals:
    """Recompute the residuals of an answer that has an x.

    A relaxed bound that is infinite constrains nothing and carries no multiplier.
    """
    x = answer.x
    assert x is not None
    primal = _primal(program, x)
    if (
        (program.A is not None and answer.y is None)
        or (program.G is not None and answer.z is None)
        or ((program.lb is not None or program.ub is not None) and answer.z_box is None)
    ):
        return Residuals(primal, float("nan"), float("nan"))
    Px = program.P @ x
    gradient = Px + program.q
    gap = float(x @ gradient)
    wrong_sign = 0.0
    if program.A is not None and program.b is not None and answer.y is not None:
        gradient = gradient + program.A.T @ answer.y
        gap += float(program.b @ answer.y)
    if program.G is not None and program.h is not None and answer.z is not None:
        gradient = gradient + program.G.T @ answer.z
        finite = np.isfinite(program.h)
        gap += float(program.h[finite] @ answer.z[finite])
        wrong_sign = float(np.max(-answer.z, initial=0.0))
        wrong_sign = max(wrong_sign, float(np.max(np.abs(answer.z[~finite]), initial=0.0)))
    if answer.z_box is not None and (program.lb is not None or program.ub is not None):
        gradient = gradient + answer.z_box
        for bound, push in (
            (program.ub, np.maximum(answer.z_box, 0.0)),
            (program.lb, np.minimum(answer.z_box, 0.0)),
        ):
            finite = np.zeros(len(push), dtype=bool) if bound is None else np.isfinite(bound)
            if bound is not None:
                gap += float(bound[finite] @ push[finite])
            # Nothing can push at a bound that is not there.
            wrong_sign = max(wrong_sign, float(np.max(np.abs(push[~finite]), initial=0.0)))
    scale = max(1.0, float(np.abs(program.P).max()))
    dual = max(float(np.abs(gradient).max()), wrong_sign) / scale
    return Residuals(primal, dual, abs(gap) / scale)


def _primal(program: QuadraticProgram, x: Array) -> float:
    worst = 0.0
    if program.A is not None and program.b is not None:
        worst = float(np.abs(program.A @ x - program.b).max(initial=0.0))
    if program.G is not None and program.h is not None:
        worst = max(worst, float((program.G @ x - program.h).max(initial=0.0)))
    if program.lb is not None:
        worst = max(worst, float((program.lb - x).max()))
    if program.ub is not None:
        worst = max(worst, float((x - program.ub).max()))
    return worst
