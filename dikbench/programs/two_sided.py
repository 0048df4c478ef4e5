"""A quadratic program whose conditions are rows with two sides, as many libraries take them."""

from __future__ import annotations

import numpy as np

from dikbench.arrays import Array
from dikbench.programs.quadratic_program import QuadraticProgram


def two_sided(program: QuadraticProgram) -> tuple[Array, Array, Array]:
    """Write all conditions of a program as lower <= M x <= upper.

    Returns:
        M (m, n), lower and upper (m,), possibly infinite: the rows of G, of A, and one for each x
        where there are bounds.
    """
    n = len(program.q)
    nothing = np.empty((0, n)), np.empty(0), np.empty(0)
    parts = [nothing]
    if program.G is not None and program.h is not None:
        parts.append((program.G, np.full(len(program.h), -np.inf), program.h))
    if program.A is not None and program.b is not None:
        parts.append((program.A, program.b, program.b))
    if program.lb is not None or program.ub is not None:
        lower = np.full(n, -np.inf) if program.lb is None else program.lb
        upper = np.full(n, np.inf) if program.ub is None else program.ub
        parts.append((np.eye(n), lower, upper))
    M, lower, upper = (np.concatenate(each) for each in zip(*parts, strict=True))
    return M, lower, upper


def multipliers_of(program: QuadraticProgram, y: Array) -> dict[str, Array]:
    """Split the multipliers of `two_sided` rows into those of an `Answer`: y, z and z_box.

    Args:
        program: the program.
        y: (m,), with P x + q + M^T y = 0: negative where the lower side holds.
    """
    i = 0 if program.h is None else len(program.h)
    j = i + (0 if program.b is None else len(program.b))
    return {"z": y[:i], "y": y[i:j], "z_box": y[j:]}
