"""Where single rows are asked for, what is judged is the error of these rows, and nothing else."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import solve_for

from dikbench.arrays import Array
from dikbench.metrics import motion_of
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem import Kinematics
from dikbench.problem.progress import CHARACTERISTIC_LENGTH_M
from dikbench.scenario import Scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import simulate

ROWS = ("xyrz", "world:xyrz", "xyzrx", "world:xyzry", "xry", "zrxry", "rz")


@lru_cache
def scenario(rows: str, length: float = CHARACTERISTIC_LENGTH_M) -> Scenario:
    """A target that turns and tilts there and back."""
    asked = f"robot=ur5,rows={rows},characteristic_length={length}"
    return make_scenario(f"back-and-forth[{asked}]")


def placed(rows: tuple[int, ...], world: bool, X_d: pin.SE3, e: Array, free: Array) -> pin.SE3:
    """Place a frame that has the errors e (6,) [m; rad] of these rows, and others at will.

    One or two turns are asked for: e is of one of them, the free ones tilt or turn the frame.
    """
    asked, angular = np.isin(np.arange(6), rows), [row - 3 for row in rows if row >= 3]
    errors = np.where(asked, e, free)
    across, along = errors[3:].copy(), errors[3:].copy()
    across[angular], along[[k for k in range(3) if k not in angular]] = 0.0, 0.0
    # The error is that of M = R^T R_d, or R_d R^T in the world's axes.
    first, second = (along, across) if len(angular) == 1 else (across, along)
    M = pin.exp3(first) @ pin.exp3(second)
    if len(angular) == 2 and world:
        M = pin.exp3(second) @ pin.exp3(first)
    if world:
        R = M.T @ X_d.rotation
        return pin.SE3(R, X_d.translation - errors[:3])
    R = X_d.rotation @ M.T
    return pin.SE3(R, X_d.translation - R @ errors[:3])


@settings(max_examples=60, deadline=None)
@given(
    rows=st.sampled_from(ROWS), seed=st.integers(0, 2**32 - 1), wrong=st.sampled_from([0.0, 3e-3])
)
def test_what_is_judged_is_what_is_asked_for(rows: str, seed: int, wrong: float) -> None:
    """An error of zero is a distance of zero, one of e is e; whatever the frame does otherwise."""
    case, random = scenario(rows), np.random.default_rng(seed)
    asked, row = case.rows, int(random.choice(case.rows))
    times = np.sort(random.uniform(0, case.reference.duration, 40))
    targets = [case.reference.placement(tau) for tau in times.tolist()]
    e = np.zeros(6)
    e[row] = wrong * (1.0 if row < 3 else 1 / CHARACTERISTIC_LENGTH_M)
    world = rows.startswith("world")
    made = [placed(asked, world, X_d, e, random.uniform(-0.7, 0.7, 6)) for X_d in targets]
    (R, p), (R_d, p_d) = (
        (np.array([X.rotation for X in each]), np.array([X.translation for X in each]))
        for each in (made, targets)
    )
    points, at = case.points_at(times, (R, p), (R_d, p_d))
    np.testing.assert_allclose(np.linalg.norm(points - at, axis=1), wrong, atol=1e-6)
    assert case.embedded_path is not None
    off, _, _ = case.embedded_path.nearest(points)
    assert off.max() <= wrong + 1e-6
    if not wrong:
        assert off.max() <= 1e-6


@pytest.mark.parametrize(
    ("rows", "mode", "length"),
    [
        ("xyrz", "time", 0.2),
        ("world:xyrz", "path", 0.5),
        ("zrx", "time", 0.1),
        ("zrx", "path", 0.2),
    ],
)
def test_a_run_is_judged_by_its_own_error(rows: str, mode: ReferenceMode, length: float) -> None:
    """The distance from the target is the length of the task's error, angles times L."""
    case, law = scenario(rows, length), make_formulation("pinv")
    run = simulate(case, law, solve_for(law), make_plant("ideal"), mode)
    motion, kinematics = motion_of(run.trace, case, run.jacobians), Kinematics(case.robot)
    lever = np.where(np.array(case.rows) < 3, 1.0, length)
    errors = []
    for q, tau in zip(run.trace.q, run.trace.tau.tolist(), strict=True):
        kinematics.update(q)
        errors.append(lever * case.tracking.linearize(kinematics, case.target(tau)[0]).error)
    lengths = np.linalg.norm(errors, axis=1)
    np.testing.assert_allclose(motion.tracking_error, lengths, atol=1e-6)
    assert motion.contour_error_6d.max() <= lengths.max() + 1e-6
    assert motion.contour_error.max() <= motion.position_error.max() + 1e-6
    assert case.feasible == "time"
    along = motion.along_path
    assert along is not None
    assert along.tolerances[0] <= lengths.max() + 1e-6
