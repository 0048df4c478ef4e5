"""The damped inverse and what it leaves free, against closed forms and figures of the design."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench import load_robot
from dikbench.arrays import Array
from dikbench.linear_algebra import DampedInverse, damped_least_squares, pseudo_inverse
from dikbench.robots.kinematics import Kinematics
from dikbench.testing.states import SINGULAR


def random_matrix(seed: int, m: int, n: int, rank: int) -> Array:
    """A matrix (m, n) of a given rank, its other singular values between 0.1 and 2."""
    random = np.random.default_rng(seed)
    U, V = (np.linalg.qr(random.normal(size=(size, size)))[0] for size in (m, n))
    A: Array = U[:, :rank] * random.uniform(0.1, 2, rank) @ V[:, :rank].T
    return A


SHAPES = {
    "seed": st.integers(0, 10**6),
    "m": st.integers(1, 7),
    "n": st.integers(1, 7),
    "lost": st.integers(0, 3),
}


@given(**SHAPES)
@settings(deadline=None, max_examples=100)
def test_undamped_it_is_the_moore_penrose_inverse(seed: int, m: int, n: int, lost: int) -> None:
    """Without damping it does what A^+ does and takes A^+ A, at any rank, with both projectors."""
    A = random_matrix(seed, m, n, max(min(m, n) - lost, 0))
    b = np.random.default_rng(seed).normal(size=m)
    inverse, reference = DampedInverse(A, 1e-9, 0.0), np.linalg.pinv(A, rcond=1e-9)
    np.testing.assert_allclose(inverse.times(b), reference @ b, atol=1e-12)
    np.testing.assert_allclose(inverse.times(b), pseudo_inverse(A, 1e-9) @ b, atol=1e-12)
    np.testing.assert_allclose(inverse.taken("exact"), reference @ A, atol=1e-12)
    np.testing.assert_allclose(inverse.taken("damped"), reference @ A, atol=1e-12)


@given(**SHAPES, damping=st.floats(1e-2, 1.0))
@settings(deadline=None, max_examples=100)
def test_damped_closed_form(seed: int, m: int, n: int, lost: int, damping: float) -> None:
    """With damping it is A^T (A A^T + lambda^2 I)^-1; the exact projector does not depend on it."""
    A = random_matrix(seed, m, n, max(min(m, n) - lost, 0))
    b = np.random.default_rng(seed).normal(size=m)
    reference = A.T @ np.linalg.inv(A @ A.T + damping**2 * np.eye(m))
    inverse = DampedInverse(A, 1e-9, damping)
    np.testing.assert_allclose(inverse.times(b), reference @ b, atol=1e-10)
    np.testing.assert_allclose(inverse.taken("damped"), reference @ A, atol=1e-10)
    np.testing.assert_array_equal(
        inverse.taken("exact"), DampedInverse(A, 1e-9, 0.0).taken("exact")
    )


@pytest.mark.parametrize(
    ("damping", "leak"), [(0.01, 4.5e-4), (0.05, 1.1e-2), (0.1, 3.8e-2)], ids=str
)
def test_damped_projector_leaks(damping: float, leak: float) -> None:
    """At the Panda's start ||J (I - J^# J)|| is what the design says; ||J (I - J^+ J)|| is 0."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    J = kinematics.jacobian(robot.frame_id)
    inverse = DampedInverse(J, 1e-6, damping)
    figure = np.linalg.norm(J - J @ inverse.taken("damped"), 2)
    assert figure == pytest.approx(leak, rel=0.025)
    assert np.linalg.norm(J - J @ inverse.taken("exact"), 2) < 1e-14


def test_tolerance_is_absolute_and_belongs_to_zero() -> None:
    """A singular value that equals the tolerance is dropped, one above it is kept; damped too."""
    A, b = np.diag([2.0, 0.5, 0.25]), np.ones(3)
    np.testing.assert_allclose(DampedInverse(A, 0.25, 0.0).times(b), [0.5, 2, 0])
    np.testing.assert_allclose(DampedInverse(A, 0.5, 0.0).times(b), [0.5, 0, 0])
    damped = DampedInverse(A, 0.5, 1.0)
    np.testing.assert_allclose(damped.times(b), [0.4, 0, 0])
    np.testing.assert_allclose(damped.taken("exact"), np.diag([1.0, 0, 0]))
    np.testing.assert_allclose(damped.taken("damped"), np.diag([0.8, 0, 0]))


def test_nothing_left_free_gives_nothing() -> None:
    """Of a matrix of zeros nothing comes, with tolerance 0 and no damping."""
    inverse = DampedInverse(np.zeros((2, 3)), 0.0, 0.0)
    np.testing.assert_array_equal(inverse.times(np.ones(2)), np.zeros(3))
    np.testing.assert_array_equal(inverse.taken("damped"), np.zeros((3, 3)))


@given(**SHAPES, exponent=st.floats(1, 10))
@settings(deadline=None, max_examples=200)
def test_least_squares_are_exact_however_little_they_are_damped(
    seed: int, m: int, n: int, lost: int, exponent: float
) -> None:
    """At any rank the damped solution is that of the singular values, undamped the shortest one."""
    A = random_matrix(seed, m, n, max(min(m, n) - lost, 0))
    b = np.random.default_rng(seed).normal(size=m)
    U, singular, Vt = np.linalg.svd(A, full_matrices=False)
    kept = singular > 1e-9
    for damping in (0.0, 10.0**-exponent):
        gain = np.divide(
            singular, singular**2 + damping**2, out=np.zeros_like(singular), where=kept
        )
        x = damped_least_squares(A, b, damping**2)
        np.testing.assert_allclose(x, Vt.T @ (gain * (U.T @ b)), rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("name", "q"), [(name, q) for name, places in SINGULAR.items() for q in places], ids=str
)
def test_undamped_least_squares_are_shortest_at_singular_postures(
    name: str, q: tuple[float, ...]
) -> None:
    """Where rank is lost up to rounding, as on a real arm, they are the pseudo-inverse's."""
    robot = load_robot(name)
    kinematics = Kinematics(robot)
    kinematics.update(np.array(q, dtype=float))
    J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
    V = np.linspace(0.3, -0.2, len(J))
    expected = pseudo_inverse(J, 1e-9) @ V
    np.testing.assert_allclose(damped_least_squares(J, V, 0.0), expected, rtol=0, atol=1e-12)
