"""What follows from a trace: singular values and angles against the libraries that define them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pinocchio as pin
import pytest
from makers.scenarios import run_of

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics import Motion, motion_of
from dikbench.metrics.motion_of_trace import rotation_angles
from dikbench.plugins.building import make_scenario

# --- the smallest singular value


def _sigma_min(jacobians: Array) -> float:
    """That of a motion of which nothing but the Jacobians is known."""
    nothing = cast(Any, None)
    return Motion(
        nothing, nothing, nothing, nothing, nothing, jacobians, nothing, nothing
    ).sigma_min


def _expected(jacobians: Array) -> float:
    return float(np.linalg.svd(jacobians, compute_uv=False)[:, -1].min())


def _with_smallest(random: np.random.Generator, m: int, n: int, smallest: Array) -> Array:
    """Random matrices (k, m, n) with these smallest singular values (k,)."""
    U, singular, Vt = np.linalg.svd(random.normal(size=(len(smallest), m, n)), full_matrices=False)
    singular[:, -1] = smallest
    J: Array = (U * singular[:, None, :]) @ Vt
    return J


SHAPES = [(3, 3), (6, 6), (6, 7), (7, 6), (6, 4), (3, 7), (1, 3), (3, 1), (6, 12)]


@pytest.mark.parametrize(("m", "n"), SHAPES)
@pytest.mark.parametrize("count", [1, 2, 300])
def test_sigma_min_is_the_smallest_of_all_singular_values(m: int, n: int, count: int) -> None:
    """Of random Jacobians, more columns than rows or the other way round."""
    random = np.random.default_rng([m, n, count])
    J = random.normal(size=(count, m, n))
    assert _sigma_min(J) == pytest.approx(_expected(J), rel=1e-12)


@pytest.mark.parametrize(("m", "n"), SHAPES)
@pytest.mark.parametrize("smallest", [1e-1, 1e-3, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12])
def test_sigma_min_near_a_singularity(m: int, n: int, smallest: float) -> None:
    """One Jacobian is nearest to a singularity, of others that are near to it too."""
    for seed in range(10):
        random = np.random.default_rng([m, n, seed])
        values = smallest * random.uniform(1.01, 1e3, 60)
        values[random.integers(60)] = smallest
        J = _with_smallest(random, m, n, values)
        found = _sigma_min(J)
        assert found == pytest.approx(_expected(J), rel=1e-9, abs=1e-15)
        assert found == pytest.approx(smallest, rel=1e-3, abs=1e-14)


@pytest.mark.parametrize(("m", "n"), SHAPES)
@pytest.mark.parametrize("others", [1e-2, 1e-7])
def test_sigma_min_at_a_singularity(m: int, n: int, others: float) -> None:
    """To the last bit, as the planar arm stretched, or but for rounding: nothing raises."""
    random = np.random.default_rng([m, n])
    J = _with_smallest(random, m, n, np.full(20, others))
    rounded = J.copy()
    rounded[7] = _with_smallest(random, m, n, np.zeros(1))[0]
    exact = J.copy()
    exact[7] = 0.0
    exact[7, 0, 0] = 1.0 if min(m, n) > 1 else 0.0
    for singular in (rounded, exact):
        assert _sigma_min(singular) == pytest.approx(0.0, abs=1e-15)
        assert _expected(singular) == pytest.approx(0.0, abs=1e-15)
    assert _sigma_min(J) == pytest.approx(others, rel=1e-6)


def test_the_last_configuration_counts_too() -> None:
    """And the first."""
    random = np.random.default_rng(0)
    J = _with_smallest(random, 6, 7, np.full(40, 0.5))
    for place in (0, -1):
        one = J.copy()
        one[place] = _with_smallest(random, 6, 7, np.full(1, 0.01))[0]
        assert _sigma_min(one) == pytest.approx(0.01)


# --- angles between rotations


ANGLES = [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.5, np.pi / 2, 2.0, 3.0]
BEFORE_PI = [1e-3, 1e-5, 1e-7, 1e-9, 0.0]


def _pairs(angle: float, count: int = 50) -> tuple[Array, Array]:
    """Pairs of rotations with this angle between them, about random axes."""
    random = np.random.default_rng(3)
    first, second = [], []
    for k in range(count):
        axis = random.normal(size=3) if k > 2 else np.eye(3)[k]
        R = pin.exp3(random.normal(size=3))
        first.append(R)
        second.append(R @ pin.exp3(angle * axis / np.linalg.norm(axis)))
    return np.array(first), np.array(second)


@pytest.mark.parametrize("angle", [*ANGLES, *(np.pi - less for less in BEFORE_PI)])
def test_rotation_angles_are_the_lengths_of_logarithms(angle: float) -> None:
    """Those of pinocchio.log3, and the angle that was put in, from 0 to pi."""
    first, second = _pairs(angle)
    found = rotation_angles(first, second)
    assert found == pytest.approx(angle, rel=1e-9, abs=1e-14)
    logarithms = [pin.log3(R.T @ S) for R, S in zip(first, second, strict=True)]
    # Half the digits are left to a logarithm that looks at the cosine only near pi.
    assert found == pytest.approx(np.linalg.norm(logarithms, axis=1), rel=1e-7, abs=1e-12)
    assert rotation_angles(second, first) == pytest.approx(found, rel=1e-9, abs=1e-14)


def test_rotation_angles_of_many_different_pairs() -> None:
    """Each pair its own."""
    random = np.random.default_rng(4)
    first, second = (
        np.array([pin.exp3(3 * random.normal(size=3)) for _ in range(200)]) for _ in range(2)
    )
    logarithms = [pin.log3(R.T @ S) for R, S in zip(first, second, strict=True)]
    found = rotation_angles(first, second)
    assert found == pytest.approx(np.linalg.norm(logarithms, axis=1))
    assert found.min() < 0.5 < 3.0 < found.max()


# --- a trace that is not the scenario's


@pytest.mark.parametrize("part", ["q", "applied"])
def test_a_trace_of_another_robot_is_one_line(part: str) -> None:
    """Of a robot with another number of joints."""
    scenario = make_scenario("step")
    trace = run_of("pinv", scenario).trace
    other = replace(trace, **{part: getattr(trace, part)[:, :-1]})
    message = rf"^trace of another robot: {part} has shape \(\d+, \d\); valid for \w+: .*$"
    with pytest.raises(DikbenchError, match=message):
        motion_of(other, scenario)
