"""A program written in cvxpy's modelling language."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from dikbench.programs.quadratic_program import QuadraticProgram


class ModelledProgram:
    """A compiled cvxpy problem whose parameters hold this step's values.

    Attributes:
        model: the `cvxpy.Problem`, in disciplined parametrised form, compiled once.
        unknowns: its variables; x is their values, stacked in this order.
        matrices: the same program in matrices, by which the answer is rechecked off the clock.
    """

    __slots__ = ("matrices", "model", "unknowns")

    def __init__(
        self, model: Any, unknowns: tuple[Any, ...], matrices: Callable[[], QuadraticProgram]
    ) -> None:
        self.model = model
        self.unknowns = unknowns
        self.matrices = matrices
