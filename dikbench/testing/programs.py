"""The programs on which solvers are checked: small, seeded, of the kinds that formulations pose."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np

from dikbench.arrays import Array
from dikbench.programs.quadratic_program import QuadraticProgram

UNKNOWNS: Final = 7

FLAT: Final = 1e-6
"""The damping of a cost that is flat in some directions, as at a singularity."""

IN_A_ROW: Final = 8
"""Programs that follow each other."""

STEP: Final = 0.02
"""By how much each differs from the one before."""


class Posed(NamedTuple):
    """A program and its description."""

    label: str
    program: QuadraticProgram


def programs() -> Iterator[Posed]:
    """Make feasible programs with a unique optimum, each of new arrays."""
    for seed in range(3):
        random = np.random.default_rng(seed)
        J, n = random.normal(size=(6, UNKNOWNS)), UNKNOWNS
        P, q = J.T @ J + 1e-2 * np.eye(n), -J.T @ random.normal(size=6)
        bound = random.uniform(0.1, 1.0, n)
        inside = random.uniform(-0.9, 0.9, n) * bound
        G, A = random.normal(size=(3, n)), random.normal(size=(2, n))
        bounds: dict[str, Any] = {"lb": -bound, "ub": bound}
        yield Posed(f"program {seed}, no condition", QuadraticProgram(P.copy(), q.copy()))
        yield Posed(f"program {seed}, bounds", QuadraticProgram(P.copy(), q.copy(), **bounds))
        yield Posed(
            f"program {seed}, rows G x <= h and bounds",
            QuadraticProgram(P.copy(), q.copy(), G, G @ inside + 0.05, **_copied(bounds)),
        )
        yield Posed(
            f"program {seed}, rows A x = b and bounds",
            QuadraticProgram(P.copy(), q.copy(), A=A, b=A @ inside, **_copied(bounds)),
        )
        narrow = random.normal(size=(3, n))
        flat = narrow.T @ narrow + FLAT * np.eye(n)
        yield Posed(
            f"program {seed}, a flat cost, bounds, one of them infinite",
            QuadraticProgram(
                flat, -narrow.T @ random.normal(size=3), lb=-bound, ub=_without_first(bound)
            ),
        )


def linear_programs() -> Iterator[Posed]:
    """Make feasible programs without a quadratic cost, whose optimum is a corner."""
    for seed in range(3):
        random, n = np.random.default_rng(100 + seed), UNKNOWNS
        bound, J = random.uniform(0.1, 1.0, n), random.normal(size=(6, n))
        V = J @ (random.uniform(-2, 2, n) * bound)
        # max alpha with J v = alpha V and 0 <= alpha <= 1, as formulations scale a task
        A = np.hstack([J, -V[:, None]])
        cost = np.zeros(n + 1)
        cost[n] = -1.0
        yield Posed(
            f"linear program {seed}",
            QuadraticProgram(
                np.zeros((n + 1, n + 1)), cost, A=A, b=np.zeros(6),
                lb=np.append(-bound, 0.0), ub=np.append(bound, 1.0),
            ),
        )  # fmt: skip


def infeasible_programs() -> Iterator[Posed]:
    """Make programs whose conditions contradict each other."""
    n = UNKNOWNS
    random = np.random.default_rng(7)
    P, q = np.eye(n), random.normal(size=n)
    row = random.normal(size=n)
    both = np.stack([row, -row])
    yield Posed(
        "rows G x <= h that contradict each other",
        QuadraticProgram(P, q, both, np.full(2, -0.5), lb=np.full(n, -9.0), ub=np.full(n, 9.0)),
    )
    yield Posed(
        "an equality out of reach of the bounds",
        QuadraticProgram(
            P.copy(), q.copy(), A=np.ones((1, n)), b=np.array([2.0 * n]),
            lb=np.full(n, -1.0), ub=np.full(n, 1.0),
        ),
    )  # fmt: skip


def similar_programs() -> Iterator[Posed]:
    """Make programs of one structure that follow each other as control steps do."""
    random, n = np.random.default_rng(11), UNKNOWNS
    J, bound = random.normal(size=(6, n)), random.uniform(0.1, 1.0, n)
    turn, V = random.normal(size=(6, n)), random.normal(size=6)
    G = random.normal(size=(2, n))
    for k in range(IN_A_ROW):
        now = J + k * STEP * turn
        yield Posed(
            "programs that follow each other",
            QuadraticProgram(
                now.T @ now + 1e-2 * np.eye(n), -now.T @ V, G.copy(), np.full(2, 0.1 + k * STEP),
                lb=-bound, ub=bound * (1 - k * STEP),
            ),
        )  # fmt: skip


def _copied(parts: dict[str, Array]) -> dict[str, Any]:
    return {name: part.copy() for name, part in parts.items()}


def _without_first(bound: Array) -> Array:
    return np.append(np.inf, bound[1:])
