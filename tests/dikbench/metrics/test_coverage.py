"""Ordered coverage against its definition, sample by sample, and what must not change it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dikbench.arrays import Array, Indices
from dikbench.metrics.coverage import LARGEST_TOLERANCE_M, Coverage
from dikbench.scenario.reference.embedded_path import EmbeddedPath

ROUNDING = 1e-8


def random_case(seed: int) -> tuple[Array, Array, Indices, Array]:
    """Samples of a random walk, a motion along it, targets, and another frame's error."""
    random = np.random.default_rng(seed)
    count, n, d = random.integers(2, 120), random.integers(1, 50), random.integers(1, 5)
    samples = np.cumsum(random.normal(size=(count, d)) * random.choice([1e-3, 1e-2]), axis=0)
    if random.random() < 0.3:  # a way back on the same samples, with a rest
        samples = np.concatenate([samples, np.repeat(samples[-1:], 5, axis=0), samples[::-1]])
    if random.random() < 0.3:  # laps
        samples = np.concatenate([samples, samples[::-1]] * 3)
    targets = np.sort(random.integers(0, len(samples), n + 1))
    if random.random() < 0.3:
        targets[:] = len(samples) - 1
    noise = random.choice([0, 1e-3, 2e-2])
    points = samples[np.sort(random.integers(0, len(samples), n + 1))]
    points = points + noise * random.normal(size=points.shape)
    apart = np.abs(random.normal(size=n + 1)) * random.choice([0, 1e-2])
    return samples, points, targets, apart


def made(case: tuple[Array, Array, Indices, Array], delay: int = 0) -> Coverage:
    """The coverage of a case; targets are there so many instants after they may be covered."""
    samples, points, targets, apart = case
    there = np.searchsorted(targets, np.arange(len(samples))) + delay
    instants = np.arange(float(len(samples)))
    path = EmbeddedPath(instants, samples, instants, len(samples) - 1)
    return Coverage(path, points, targets, np.minimum(there, len(points) - 1), apart)


def distance(sample: Array, start: Array, end: Array) -> float:
    """From a sample to the segment between two points."""
    way = end - start
    length = float(way @ way)
    share = min(max(float((sample - start) @ way) / length, 0.0), 1.0) if length else 0.0
    return float(np.linalg.norm(sample - start - share * way))


def by_definition(case: tuple[Array, Array, Indices, Array], tolerance: float) -> list[int]:
    """While s < n_k and the next sample is within the tolerance of the segment, s grows."""
    samples, points, targets, apart = case
    covered: list[int] = []
    for k in range(len(points)):
        start = points[max(k - 1, 0)]
        while len(covered) <= targets[k]:
            away = max(distance(samples[len(covered)], start, points[k]), apart[k])
            if away > tolerance:
                break
            covered.append(k)
    return covered


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), tolerance=st.sampled_from([1e-3, 5e-3, 0.02, 0.1]))
def test_samples_are_covered_as_defined(seed: int, tolerance: float) -> None:
    """Whatever the path, the motion, the targets and the other frame; at any tolerance."""
    case = random_case(seed)
    for delay in (0, 3):
        assert made(case, delay).instants(tolerance).tolist() == by_definition(case, tolerance)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), data=st.data())
def test_the_tolerance_needed_is_where_the_definition_turns(seed: int, data: st.DataObject) -> None:
    """A little more covers the sample by the instant, a little less does not."""
    case = random_case(seed)
    samples, points, targets, _ = case
    sample = data.draw(st.integers(0, len(samples) - 1))
    until = data.draw(st.integers(0, len(points) - 1))
    coverage = made(case, data.draw(st.integers(0, 3)))
    needed, again = coverage.needed([(sample, until), (sample // 2, until)])

    def holds(tolerance: float, which: int = sample) -> bool:
        covered = by_definition(case, tolerance)
        return len(covered) > which and covered[which] <= until

    if needed == np.inf:
        assert sample > targets[until] or not holds(LARGEST_TOLERANCE_M - ROUNDING)
    else:
        assert holds(needed + ROUNDING)
        assert needed < ROUNDING or not holds(needed - ROUNDING)
        assert holds(again + ROUNDING, sample // 2)
    assert again <= needed


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_larger_tolerance_covers_no_less_and_no_later(seed: int) -> None:
    """Sample by sample."""
    coverage = made(random_case(seed))
    before: Indices = np.empty(0, dtype=int)
    for tolerance in (5e-4, 1e-3, 5e-3, 0.02, 0.1, 0.25):
        covered = coverage.instants(tolerance)
        assert len(covered) >= len(before)
        assert all(now <= then for now, then in zip(covered, before, strict=False))
        before = covered


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_rigid_motion_of_the_world_changes_nothing(seed: int) -> None:
    """A turn and a shift of path and motion together."""
    samples, points, targets, apart = case = random_case(seed)
    random = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(random.normal(size=(samples.shape[1],) * 2))
    shift = random.normal(size=samples.shape[1])
    moved = samples @ turn + shift, points @ turn + shift, targets, apart
    wanted = [(len(samples) - 1, len(points) - 1), (len(samples) // 2, len(points) // 2)]
    assert made(moved).needed(wanted) == pytest.approx(made(case).needed(wanted), abs=ROUNDING)


def test_a_fast_step_misses_no_sample() -> None:
    """Two steps along 40 samples: segments are looked at, not points."""
    samples = np.linspace([0.0, 0.0], [0.4, 0.0], 41)
    points = np.array([[0.0, 0.0], [0.2, 0.0], [0.4, 0.0]])
    coverage = made((samples, points, np.array([0, 20, 40]), np.zeros(3)))
    assert coverage.instants(1e-3).tolist() == [0, *[1] * 20, *[2] * 20]
    assert coverage.needed([(40, 2)])[0] == pytest.approx(0.0, abs=ROUNDING)


def test_standing_still_does_not_cover_a_closed_path() -> None:
    """Of a circle only what is within the tolerance of its start, though it ends there."""
    angle = np.linspace(0, 2 * np.pi, 401)
    circle = 0.1 * np.column_stack([np.sin(angle), 1 - np.cos(angle)])
    points, last = np.zeros((100, 2)), np.full(100, 400)
    coverage = made((circle, points, last, np.zeros(100)))
    assert len(coverage.instants(5e-3)) == 4  # 1.57 mm apart
    assert coverage.needed([(400, 99)])[0] == pytest.approx(0.2, abs=1e-5)
