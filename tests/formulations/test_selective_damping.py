"""Selectively damped least squares: by hand on a planar arm, and against the definition."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import equation, problem_of, velocity_of

from dikbench.arrays import Array

STRETCHED = np.array([[0.0, 0.0], [2.0, 1.0]])
"""Position Jacobian of two links of 1 m along x."""

SQUARE = np.array([[-1.0, -1.0], [1.0, 0.0]])
"""The same with the elbow at a right angle; its singular values are phi and 1/phi."""

PHI = (1 + sqrt(5)) / 2


def answer(law: str, *tasks: tuple[Array, Array]) -> Array:
    """What a law gives for several tasks (J, V) of first priority, and one of the second."""
    n = tasks[0][0].shape[1]
    first = [equation(J, V) for J, V in tasks]
    return velocity_of(law, problem_of(*first, equation(np.eye(n), np.ones(n), priority=2)))


def test_stretched_arm_by_hand() -> None:
    """Only y can be moved, by v_1 = (2, 1)/sqrt(5): M_1 = N_1 = 1, so gamma_1 = gamma_max = 2."""
    # Below the limit: (2, 1) y/5. Above it the hard clamp cuts the larger joint to 2.
    np.testing.assert_allclose(
        answer("sdls", (STRETCHED, np.array([7.0, 1.0]))), [0.4, 0.2], atol=1e-15
    )
    np.testing.assert_allclose(
        answer("sdls", (STRETCHED, np.array([0.0, 10.0]))), [2, 1], atol=1e-14
    )
    # The soft one takes 2/(2 + largest) of it, at any speed.
    for y in (1.0, 10.0, 1000.0):
        full = np.array([2, 1]) * y / 5
        v = answer("sdls[clamp=soft]", (STRETCHED, np.array([0.0, y])))
        np.testing.assert_allclose(v, full * 2 / (2 + full[0]), rtol=1e-14)
    # Nothing moves x.
    np.testing.assert_allclose(
        answer("sdls", (STRETCHED, np.array([9.0, 0.0]))), [0, 0], atol=1e-15
    )


def test_elbow_at_a_right_angle_by_hand() -> None:
    """The weak direction v_2 ~ (1, -phi) has gamma_2 = gamma_max/M_2, M_2 = phi (sqrt2 + phi)/l."""
    length = sqrt(1 + PHI**2)
    weak = np.array([1, -PHI]) / length
    lost = PHI * (SQUARE @ weak)  # u_2
    M = PHI * (sqrt(2) + PHI) / length
    fastest = PHI / length  # of v_2's joints
    v = answer("sdls", (SQUARE, 100 * lost))
    np.testing.assert_allclose(v, weak / fastest * 2 / M, rtol=1e-12)
    # Slow enough not to be limited at all: 0.1 phi v_2.
    np.testing.assert_allclose(answer("sdls", (SQUARE, 0.1 * lost)), 0.1 * PHI * weak, rtol=1e-12)
    gamma = 2 / M
    soft = 100 * PHI * weak * gamma / (gamma + 100 * PHI * fastest)
    np.testing.assert_allclose(answer("sdls[clamp=soft]", (SQUARE, 100 * lost)), soft, rtol=1e-12)


def test_a_joint_of_no_reach_is_moved_all_the_same() -> None:
    """J = diag(1, eps): M_2 = 1 whatever eps is, so joint 2 runs at gamma_max, until it is lost."""
    for eps, speed in ((1e-3, 2.0), (1e-9, 2.0), (1e-11, 0.0)):
        v = answer("sdls", (np.diag([1.0, eps]), np.array([0.0, 1.0])))
        np.testing.assert_allclose(v, [0, speed], rtol=1e-9)


def definition(tasks: list[tuple[Array, Array]], most: float, clamp: str) -> Array:
    """The law as it is published, loop by loop; every task is an end effector."""
    J = np.vstack([task[0] for task in tasks])
    V = np.concatenate([task[1] for task in tasks])
    U, sigma, Vt = np.linalg.svd(J, full_matrices=False)
    ends = np.cumsum([len(task[1]) for task in tasks])
    blocks = [slice(end - len(task[1]), end) for end, task in zip(ends, tasks, strict=True)]
    total = np.zeros(J.shape[1])
    for i, s in enumerate(sigma):
        if s <= 1e-10:
            continue
        N = sum(np.linalg.norm(U[k, i]) for k in blocks)
        M = 0.0
        for j in range(J.shape[1]):
            M += abs(Vt[i, j]) * sum(np.linalg.norm(J[k, j]) for k in blocks) / s
        gamma = min(1.0, N / M) * most
        phi = (U[:, i] @ V) / s * Vt[i]
        largest = np.abs(phi).max()
        if clamp == "soft":
            total += phi * gamma / (gamma + largest)
        else:
            total += phi if largest <= gamma else phi * gamma / largest
    largest = float(np.abs(total).max())
    if largest <= most:
        return total
    return total * most / (most + largest if clamp == "soft" else largest)


@pytest.mark.parametrize("clamp", ["hard", "soft"])
@given(seed=st.integers(0, 2**32 - 1), speed=st.sampled_from([0.1, 1.0, 3.0, 100.0]))
@settings(deadline=None, max_examples=60)
def test_law_is_its_definition(clamp: str, seed: int, speed: float) -> None:
    """One end effector or several, few and many joints, slow and fast."""
    random = np.random.default_rng(seed)
    n = int(random.integers(2, 9))
    tasks = [
        (random.normal(size=(m, n)), speed * random.normal(size=m))
        for m in random.integers(1, 5, size=random.integers(1, 4))
    ]
    v = answer(f"sdls[max_rate=1.5,clamp={clamp}]", *tasks)
    np.testing.assert_allclose(v, definition(tasks, 1.5, clamp), rtol=1e-9, atol=1e-12)
    assert np.abs(v).max() <= 1.5 * (1 + 1e-12)


def test_soft_clamp_jumps_to_half_where_the_sum_reaches_the_limit() -> None:
    """Two directions that share a joint: faster up to the limit, then back to half of it."""
    J = np.array([[1.0, 1.0], [0.9, -0.9]]) / sqrt(2)
    scales = np.linspace(0.1, 20, 2000)
    speeds = [
        float(np.abs(answer("sdls[clamp=soft,max_rate=1]", (J, np.array([s, s])))).max())
        for s in scales
    ]
    jump = int(np.argmin(np.diff(speeds)))
    assert speeds[jump] == pytest.approx(1.0, abs=0.01)
    assert speeds[jump + 1] == pytest.approx(0.5, abs=0.01)
    assert max(speeds) <= 1.0
