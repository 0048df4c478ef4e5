"""A path through placements: where it passes, how fast, and along which way."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.scenario.reference.pose_file import read_poses
from dikbench.scenario.reference.waypoints import held, through

twists = st.lists(
    st.lists(st.floats(-0.7, 0.7), min_size=6, max_size=6), min_size=2, max_size=5
).map(lambda rows: [pin.exp6(pin.Motion(np.array(row))) for row in rows])
gaps = st.lists(st.floats(0.2, 3.0), min_size=4, max_size=4)


def _times(placements: list[Any], gaps: list[float]) -> list[float]:
    return [0.0, *np.cumsum(gaps[: len(placements) - 1])]


@given(twists, gaps, st.booleans())
def test_it_passes_every_placement_at_its_time(
    placements: list[Any], gaps: list[float], smooth: bool
) -> None:
    """And stays at the last one after the end."""
    times = _times(placements, gaps)
    reference = through(times, placements, smooth=smooth)
    assert reference.duration == times[-1]
    for time, placement in zip(times, placements, strict=True):
        assert reference.placement(time).homogeneous == pytest.approx(placement.homogeneous)
    beyond = reference.placement(times[-1] + 1.0)
    assert beyond.homogeneous == pytest.approx(placements[-1].homogeneous)


@given(twists, gaps, st.booleans(), st.floats(0.05, 0.95))
def test_velocity_is_the_derivative_of_the_placement(
    placements: list[Any], gaps: list[float], smooth: bool, share: float
) -> None:
    """The body twist within every segment, by central differences."""
    times, h = _times(placements, gaps), 1e-5
    reference = through(times, placements, smooth=smooth)
    for here, there in pairwise(times):
        tau = here + share * (there - here)
        before, after = reference.placement(tau - h), reference.placement(tau + h)
        twist = pin.log6(before.actInv(after)).np / (2 * h)
        assert reference.velocity(tau) == pytest.approx(twist, abs=1e-6)


@given(twists, gaps, st.booleans())
def test_half_the_time_is_half_the_way(
    placements: list[Any], gaps: list[float], smooth: bool
) -> None:
    """The middle of a segment is as far from its beginning as from its end, along one screw."""
    times = _times(placements, gaps)
    reference = through(times, placements, smooth=smooth)
    middle = reference.placement(times[1] / 2)
    there = pin.log6(placements[0].actInv(middle)).np
    onwards = pin.log6(middle.actInv(placements[1])).np
    assert there == pytest.approx(onwards, abs=1e-9)


@given(twists, gaps)
def test_a_smooth_path_rests_at_every_placement(placements: list[Any], gaps: list[float]) -> None:
    """Without velocity, and without acceleration: the velocity grows as the square of the time."""
    times = _times(placements, gaps)
    reference = through(times, placements, smooth=True)
    for time in times:
        assert np.abs(reference.velocity(time)).max() < 1e-9
    first, second = (np.linalg.norm(reference.velocity(h * times[1])) for h in (1e-4, 2e-4))
    assert second == pytest.approx(4 * first, rel=1e-3, abs=1e-12)


@given(twists, gaps)
def test_a_path_that_is_not_smooth_keeps_its_twist_within_a_segment(
    placements: list[Any], gaps: list[float]
) -> None:
    """The log of the way over the time that it takes."""
    times = _times(placements, gaps)
    reference = through(times, placements, smooth=False)
    way = pin.log6(placements[0].actInv(placements[1])).np
    for share in (0.0, 0.3, 0.99):
        assert reference.velocity(share * times[1]) == pytest.approx(way / times[1], abs=1e-12)


@given(twists, gaps, st.floats(0.0, 0.999))
def test_a_placement_is_held_until_the_time_of_the_next_one(
    placements: list[Any], gaps: list[float], share: float
) -> None:
    """At rest, and the last one from its own time on."""
    times = _times(placements, gaps)
    reference = held(times, placements)
    for k, (here, there) in enumerate(pairwise(times)):
        tau = here + share * (there - here)
        assert reference.placement(tau) == placements[k]
        assert not reference.velocity(tau).any()
    assert reference.placement(times[-1]) == placements[-1]


@pytest.mark.parametrize("origin", [0.0, 1000.0, 1.7e9])
def test_the_feed_forward_of_a_sample_at_a_row_is_that_of_the_segment_that_begins_there(
    origin: float, tmp_path: Path
) -> None:
    """Whatever clock the rows of a file are stamped by: its integral passes every row."""
    path = tmp_path / "to_and_fro.csv"
    rows = [f"{origin + k / 10!r},{0.1 * (k % 2)},0,0,0,0,0,1" for k in range(21)]
    path.write_text("\n".join(["t,x,y,z,qx,qy,qz,qw", *rows]), encoding="utf-8")
    poses = read_poses(str(path))
    reference = through(poses.times, poses.placements, smooth=False)
    x, dt = 0.0, 0.01
    for n in range(200):
        x += reference.velocity(n * dt)[0] * dt
        assert x == pytest.approx(reference.placement((n + 1) * dt).translation[0], abs=1e-9)


def test_the_smooth_way_is_that_of_least_jerk() -> None:
    """Among quintics and septics from rest to rest it has the smallest integral of squared jerk."""
    reference = through([0.0, 1.0], [pin.SE3.Identity(), _along_x(1.0)], smooth=True)
    tau, dt = np.linspace(0.0, 1.0, 2001, retstep=True)
    x = np.array([reference.placement(t).translation[0] for t in tau])

    def jerk(positions: Any) -> float:
        third = np.diff(positions, 3) / dt**3
        return float(np.sum(third**2) * dt)

    assert jerk(x) == pytest.approx(720, rel=1e-2)  # known in closed form
    for size in (0.05, -0.05):
        assert jerk(x + size * (tau * (1 - tau)) ** 3) > jerk(x)


def _along_x(distance: float) -> Any:
    return pin.SE3(np.eye(3), np.array([distance, 0.0, 0.0]))
