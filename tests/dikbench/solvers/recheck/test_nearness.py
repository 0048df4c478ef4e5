"""How near the optimum an answer is, by its residuals, where the optimum is known."""

from __future__ import annotations

import numpy as np
import pytest
from makers.programs import LIBRARIES_WARN, residuals_of

from dikbench.arrays import Array
from dikbench.programs.answer import Answer
from dikbench.programs.quadratic_program import QuadraticProgram
from dikbench.solvers.recheck.residuals import Residuals, residuals
from dikbench.solvers.recheck.stack import Stack

pytestmark = LIBRARIES_WARN


MANY = 48


class _Known:
    """A random program that was put together from its optimum, and a point well inside of it.

    Attributes:
        program: the program.
        x: the optimum; unique where the cost is strictly convex.
        inside: a feasible point whose distance to every inequality is positive.
        y, z, z_box: the multipliers of x.
    """

    def __init__(self, random: np.random.Generator, P: Array) -> None:
        n, m, p = len(P), 1, 2
        self.x = random.uniform(-1, 1, n)
        A = random.normal(size=(m, n))
        off = random.uniform(-0.5, 0.5, n)
        self.inside = self.x + off - A.T @ np.linalg.solve(A @ A.T, A @ off)
        # A row is active where it may be, and then looks away from the point inside.
        G = random.normal(size=(p, n))
        G *= -np.sign(G @ (self.inside - self.x))[:, None]
        active = np.array([True, False])
        h = G @ self.x + np.where(active, 0.0, 1.0)
        to_inside = self.inside - self.x
        bounded = random.random(n) < 0.5
        lower = np.where(bounded & (to_inside > 0), self.x, -3.0)
        upper = np.where(bounded & (to_inside < 0), self.x, 3.0)
        self.y = random.normal(size=m)
        self.z = np.where(active, random.uniform(0.1, 2, p), 0.0)
        self.z_box = -np.sign(to_inside) * np.where(bounded, random.uniform(0.1, 2, n), 0.0)
        q = -(P @ self.x + A.T @ self.y + G.T @ self.z + self.z_box)
        self.program = QuadraticProgram(P, q, G, h, A, A @ self.x, lower, upper)

    def answer(self, x: Array) -> Answer:
        """This x with the exact multipliers."""
        return Answer(x, True, self.y, self.z, self.z_box)

    def beside(self, random: np.random.Generator, x: Array, size: float) -> Answer:
        """This x with other multipliers of the right signs."""
        y, z, z_box = (v + size * random.normal(size=v.shape) for v in (self.y, self.z, self.z_box))
        z_box = np.where(self.z_box * z_box > 0, z_box, 0.0)
        return Answer(x, True, y, np.maximum(z, 0.0), z_box)

    def distance(self, x: Array) -> float:
        """What `nearness` bounds: the way to the optimum where it is unique, else the cost."""
        if np.diagonal(self.program.P).all():
            return float(np.abs(x - self.x).max())
        cost, best = (0.5 * p @ self.program.P @ p + self.program.q @ p for p in (x, self.x))
        return abs(float(cost - best))


def _definite(random: np.random.Generator, n: int) -> Array:
    """Eigenvalues over four decades."""
    Q = np.linalg.qr(random.normal(size=(n, n)))[0]
    P: Array = (Q * 10.0 ** random.uniform(-3, 1, n)) @ Q.T
    return (P + P.T) / 2


def _linear(random: np.random.Generator, n: int) -> Array:
    """No cost in some directions at all, such as the velocities of alpha scaling; or in none."""
    P = np.zeros((n, n))
    some = int(random.integers(0, n))
    P[:some, :some] = _definite(random, some) if some else 0.0
    return P


SIZES = (0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, 0.1, 1.0)


COSTS = {"strictly-convex": _definite, "linear": _linear}


def _all_known(cost: str, seed: int) -> tuple[np.random.Generator, list[_Known]]:
    """Many programs of one structure."""
    random = np.random.default_rng([seed, len(cost)])
    return random, [_Known(random, COSTS[cost](random, 5)) for _ in range(MANY)]


def _assert_bounded(found: Residuals, distances: list[float]) -> None:
    assert np.isfinite(found.nearness).all()
    assert np.all(found.nearness * (1 + 1e-3) + 1e-9 >= distances)


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("seed", range(3))
def test_the_known_optima_are_what_they_are_said_to_be(cost: str, seed: int) -> None:
    """Their residuals vanish, some bounds and inequalities push, and `inside` is feasible."""
    _, known = _all_known(cost, seed)
    for k in known:
        right = residuals_of(k.program, k.answer(k.x))
        assert max(right.primal[0], right.dual[0], right.gap[0]) < 1e-12
        assert residuals_of(k.program, k.answer(k.inside)).primal < 1e-12
    assert np.mean([np.count_nonzero(k.z_box) for k in known]) > 1


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", SIZES)
def test_no_feasible_answer_is_farther_than_its_nearness(cost: str, seed: int, size: float) -> None:
    """On the way from the optimum to a point inside, exact multipliers: never too near.

    At the optimum itself, and next to it, the bound is next to nothing.
    """
    _, known = _all_known(cost, seed)
    x = [k.x + size * (k.inside - k.x) for k in known]
    answers = [k.answer(there) for k, there in zip(known, x, strict=True)]
    found = residuals(Stack([k.program for k in known], answers))
    distances = [k.distance(there) for k, there in zip(known, x, strict=True)]
    if size == 1.0:
        assert min(distances) > 1e-3
    _assert_bounded(found, distances)
    if size <= 1e-12:
        # The square root of rounding over the smallest eigenvalue, or of the slack of the active.
        assert found.nearness.max() < (1e-4 if cost == "strictly-convex" else 1e-10)


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", SIZES)
def test_nor_with_other_multipliers(cost: str, seed: int, size: float) -> None:
    """Multipliers of the right signs, but wrong otherwise, make the bound larger, never too small.

    (At an upper bound for instance: no push at it at all, or one that is too strong.)
    """
    random, known = _all_known(cost, seed)
    for step in (0.0, 1e-6, 0.3):
        x = [k.x + step * (k.inside - k.x) for k in known]
        answers = [k.beside(random, there, size) for k, there in zip(known, x, strict=True)]
        found = residuals(Stack([k.program for k in known], answers))
        _assert_bounded(found, [k.distance(there) for k, there in zip(known, x, strict=True)])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", SIZES)
def test_nor_is_an_answer_that_passes_a_bound(seed: int, size: float) -> None:
    """An x beside the optimum in any direction, feasible or not, exact multipliers."""
    random, known = _all_known("strictly-convex", seed)
    x = [k.x + size * random.normal(size=5) for k in known]
    answers = [k.answer(there) for k, there in zip(known, x, strict=True)]
    found = residuals(Stack([k.program for k in known], answers))
    if size == 1e-3:
        assert found.primal.min() > 1e-5
    _assert_bounded(found, [k.distance(there) for k, there in zip(known, x, strict=True)])
