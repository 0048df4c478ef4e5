"""Programs of one structure and their answers, stacked to be rechecked together."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

import numpy as np

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram


class Stack:
    """k programs of one structure with the answers to them; every array has k as its first axis.

    Attributes:
        P, q, G, h, A, b, lb, ub: see `QuadraticProgram`; None where the programs have none.
        x: answers, (k, n).
        y, z, z_box: their multipliers (see `Answer`); None where they have none.
        explained: whether there is a multiplier for every constraint.
    """

    __slots__ = ("A", "G", "P", "b", "explained", "h", "lb", "q", "ub", "x", "y", "z", "z_box")

    def __init__(self, programs: Sequence[QuadraticProgram], answers: Sequence[Answer]) -> None:
        first, said = programs[0], answers[0]
        self.P, self.q = _stacked(programs, "P"), _stacked(programs, "q")
        self.A = self.b = self.y = None
        if first.A is not None:
            self.A, self.b = _stacked(programs, "A"), _stacked(programs, "b")
            self.y = None if said.y is None else _stacked(answers, "y")
        self.G = self.h = self.z = None
        if first.G is not None:
            self.G, self.h = _stacked(programs, "G"), _stacked(programs, "h")
            self.z = None if said.z is None else _stacked(answers, "z")
        self.lb = None if first.lb is None else _stacked(programs, "lb")
        self.ub = None if first.ub is None else _stacked(programs, "ub")
        bounded = first.lb is not None or first.ub is not None
        self.z_box = _stacked(answers, "z_box") if bounded and said.z_box is not None else None
        self.x = _stacked(answers, "x")
        self.explained = (
            (first.A is None or self.y is not None)
            and (first.G is None or self.z is not None)
            and (not bounded or self.z_box is not None)
        )


def _stacked(owners: Sequence[QuadraticProgram] | Sequence[Answer], part: str) -> Array:
    parts = list(map(attrgetter(part), owners))
    return np.concatenate(parts).reshape(len(parts), *np.shape(parts[0]))


def structure(program: QuadraticProgram, answer: Answer) -> tuple[object, ...]:
    """Return what programs and answers must have in common to be stacked."""
    A, G = program.A, program.G
    return (
        len(program.q),
        A is None or len(A),
        A is None or answer.y is None,
        G is None or len(G),
        G is None or answer.z is None,
        program.lb is None,
        program.ub is None,
        answer.z_box is None,
    )
