"""The figures that shaped the design, computed again: near misses of a crossing and of a fold."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from makers.scenarios import run_of

from dikbench.arrays import Array
from dikbench.metrics import Motion, motion_of
from dikbench.plugins.building import make_scenario
from dikbench.problem.progress import off_course, progress

WRIST = "near-miss[robot=ur5,singularity=wrist,miss={}]"
ELBOW = "near-miss[robot=panda,singularity=elbow,miss={}]"
EQUAL = np.ones(6)
LENGTH = np.array([1, 1, 1, 0.2, 0.2, 0.2])
TOLERANCE = 0.05


@lru_cache
def _motion(law: str, scenario: str) -> Motion:
    """A law's run over a scenario: time-indexed, ideal plant."""
    case = make_scenario(scenario)
    return motion_of(run_of(law, case).trace, case)


def _peak(motion: Motion) -> float:
    """Largest joint speed over its limit."""
    limit = motion.scenario.robot.limits.velocity
    assert limit is not None
    return float((np.abs(motion.trace.applied) / limit.upper).max())


def _deviation(motion: Motion, weights: Array) -> float:
    """Largest angle between the achieved and the wanted twist [deg]."""
    angle = off_course(motion.trace.wanted, motion.achieved, weights)
    return float(np.rad2deg(np.nanmax(angle)))


def _progress(motion: Motion) -> Array:
    """Progress while the reference moves."""
    moving = round(motion.scenario.reference.duration / motion.scenario.dt)
    alpha = progress(motion.trace.wanted, motion.achieved, LENGTH)[:moving]
    return alpha[~np.isnan(alpha)]


@pytest.mark.parametrize(
    ("miss", "peak"), [(0.2, 0.53), (0.05, 2.05), (0.02, 5.35), (0.005, 29.3), (0, 0.16)]
)
def test_crossing_a_singularity_is_easy_and_a_near_miss_is_hard(miss: float, peak: float) -> None:
    """Fact 1: peak speed of the pseudo-inverse over the limits, UR5 wrist at 0.5 rad/s."""
    assert _peak(_motion("pinv", WRIST.format(miss))) == pytest.approx(peak, rel=TOLERANCE)


@pytest.mark.parametrize(
    ("law", "equal", "length"),
    [
        ("pinv[after=clip]", 122.5, 157),
        ("qp", 62.7, 121),
        ("dls[damping=0.05]", 28.7, 69),
    ],
)
def test_off_course_at_a_near_miss(law: str, equal: float, length: float) -> None:
    """Fact 3: largest deviation [deg] of one near miss, with M = I and with L = 0.2 m."""
    motion = _motion(law, WRIST.format(0.02))
    assert _deviation(motion, EQUAL) == pytest.approx(equal, rel=TOLERANCE)
    assert _deviation(motion, LENGTH) == pytest.approx(length, rel=TOLERANCE)


@pytest.mark.parametrize("law", ["lp-alpha", "pinv[after=scale]"])
def test_scaling_slows_down_and_stays_on_course(law: str) -> None:
    """Fact 3: no deviation, but the smallest progress is 7.9 %, the mean 0.53."""
    motion = _motion(law, WRIST.format(0.02))
    assert _deviation(motion, EQUAL) < 0.01
    assert _deviation(motion, LENGTH) < 0.01
    assert _progress(motion).min() == pytest.approx(0.079, rel=TOLERANCE)
    assert _progress(motion).mean() == pytest.approx(0.53, rel=TOLERANCE)


def test_on_an_arm_without_null_space_scaling_is_alpha_scaling() -> None:
    """Fact 2: pseudo-inverse and uniform scaling is the LP, with symmetric velocity boxes."""
    scaling = _motion("pinv[after=scale]", WRIST.format(0.02)).trace.applied
    program = _motion("lp-alpha", WRIST.format(0.02)).trace.applied
    assert np.abs(scaling - program).max() < 1e-5


@pytest.mark.parametrize(("miss", "peak"), [(0.02, 2.70), (0.01, 3.67), (0.005, 4.83)])
@pytest.mark.parametrize(("law", "tolerance"), [("nullspace", 0.01), ("pinv", TOLERANCE)])
def test_a_fold_grows_mildly(law: str, tolerance: float, miss: float, peak: float) -> None:
    """Section 4.1: peak speed over the limits at the Panda's elbow, touched from inside."""
    assert _peak(_motion(law, ELBOW.format(miss))) == pytest.approx(peak, rel=tolerance)


def test_off_course_and_progress_at_a_fold() -> None:
    """Section 4.1: at 0.005 clipping leaves the course by 147 deg, scaling slows to 0.39."""
    clip = _motion("pinv[after=clip]", ELBOW.format(0.005))
    assert _deviation(clip, EQUAL) == pytest.approx(147, rel=TOLERANCE)
    for law in ("pinv[after=scale]", "lp-alpha"):
        slow = _motion(law, ELBOW.format(0.005))
        assert _progress(slow).min() == pytest.approx(0.39, rel=TOLERANCE)
        assert _deviation(slow, EQUAL) < 0.01
