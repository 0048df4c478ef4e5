"""Nearest points of parts of many paths, against each path by itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.scenario.reference.embedded_path import EmbeddedPath
from dikbench.scenario.reference.many_paths import ManyPaths

LONGEST_S = 0.13


def _path(random: np.random.Generator) -> EmbeddedPath:
    """A random walk that rests now and then, and turns back."""
    count = int(random.integers(2, 300))
    steps = random.normal(size=(count, 4)) * random.choice([0.0, 1e-3, 1e-2], size=(count, 1))
    points = np.vstack([np.zeros(4), np.cumsum(steps, axis=0)])
    times = np.linspace(0.0, random.uniform(0.05, 3.0), count + 1)
    arcs = np.append(0.0, np.cumsum(np.linalg.norm(steps, axis=1)))
    return EmbeddedPath(times, points, arcs, count)


@given(st.integers(0, 10**6), st.integers(1, 12))
def test_each_row_is_what_its_path_finds(seed: int, count: int) -> None:
    """At any nominal time, the ends and the samples themselves included."""
    random = np.random.default_rng(seed)
    paths = [_path(random) for _ in range(count)]
    many = ManyPaths(paths, LONGEST_S)
    rows = random.permutation(count)[: int(random.integers(1, count + 1))]
    durations = np.array([paths[row].times[-1] for row in rows])
    samples = [np.array([random.choice(paths[row].times) for row in rows]) for _ in range(3)]
    for tau in (0.0 * durations, durations, *samples, random.uniform(0, durations)):
        first = np.maximum(tau - 0.1, 0.0)
        last = np.minimum(tau + 0.03, durations)
        last = np.maximum(last, np.minimum(first + 1e-3, durations))
        first = np.minimum(first, last - 1e-4)
        points = np.array(
            [paths[row].points[random.integers(len(paths[row].times))] for row in rows]
        )
        points = points + random.normal(size=points.shape) * random.choice([0.0, 1e-3, 0.1])
        found = many.latest_nearest(rows, points, first, last)
        for k, row in enumerate(rows.tolist()):
            known = paths[row].latest_nearest(points[k], float(first[k]), float(last[k]))
            assert found[k] == pytest.approx(known, abs=1e-12)
        alone = many.latest_nearest(rows[:1], points[:1], first[:1], last[:1])
        assert alone[0] == found[0]
