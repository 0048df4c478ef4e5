"""The oracle row: the joint motion behind a scenario, scored by the metrics of every law."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from makers.runs import run_here

from dikbench.plugins.building import make_scenario
from dikbench.problem.tasks import PositionTask
from dikbench.results.reading import read_results
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot
from dikbench.run.in_workers import RunSettings
from dikbench.run.trial_row import run_trial
from dikbench.scenario.oracle import ORACLE, follow, joint_oracle, oracle_motion, solve_placement
from dikbench.scenario.reference.curves import circle
from dikbench.simulation.status import Status
from dikbench.study.plan import expand
from dikbench.study.study import Cells, Study, TimingSettings
from dikbench.study.trial import Trial

MISS = "near-miss[robot=ur5,singularity=wrist,miss=0.02]"


def test_the_oracle_tracks_exactly_at_the_price_it_was_built_with() -> None:
    """No error, no loss of direction, full progress; its speed is the certificate's."""
    # At 0.5 ms: from sample to sample the motion is a chord, which leaves the tangent as dt.
    name = f"{MISS[:-1]},dt=5e-4]"
    row = run_trial(Trial.of(ORACLE, name, "none", "ideal", "time", 0))
    assert row["status"] == "ok"
    assert row["position_error_max_m"] < 1e-9
    assert row["orientation_error_max_rad"] < 1e-9
    assert row["direction_error_max_rad"] < 0.06
    assert row["progress_min"] > 0.98
    motion = make_scenario(name).motion
    assert motion is not None
    assert row["velocity_peak_ratio"] == pytest.approx(motion.peak_speed_ratio, rel=0.01)


def test_the_oracle_of_a_limit_crossing_leaves_the_limits_as_deep_as_it_was_built() -> None:
    """The joint motion is known in closed form: its depth is the scenario's."""
    name = "joint-limit-crossing[robot=ur5,depth=0.15]"
    row = run_trial(Trial.of(ORACLE, name, "none", "ideal", "time", 0))
    assert row["position_violation_max_rad"] == pytest.approx(0.15, rel=1e-3)
    assert row["position_error_max_m"] < 1e-9


def test_a_scenario_without_a_motion_has_no_oracle() -> None:
    """A step has none: skipped, with the reason."""
    row = run_trial(Trial.of(ORACLE, "reach", "none", "ideal", "time", 0))
    assert row["status"] == Status.SKIPPED.value
    assert "no joint motion" in row["message"]


def test_a_study_runs_the_oracle_once_per_scenario_and_seed(tmp_path: Path) -> None:
    """Whatever the plants, references and solvers; it is not timed."""
    study = Study(
        description="oracle",
        cells=(Cells((ORACLE, "dls")),),
        scenarios=(MISS,),
        plants=("saturating", "ideal[noise=1e-5]"),
        references=("time", "path"),
        seeds=(0, 1),
        timing=TimingSettings("dls", 10, 1),
        name="oracle",
    )
    planned = [p.trial for p in expand(study) if p.trial.formulation.name == ORACLE]
    assert [(str(t.plant), t.reference, t.seed) for t in planned] == [
        ("ideal", "time", 0),
        ("ideal", "time", 1),
    ]
    run_here(study, tmp_path / "out", RunSettings(jobs=1), "test")
    trials = read_results(tmp_path / "out").trials
    assert (trials["status"] == "ok").all()
    times = pd.read_csv(tmp_path / "out" / "timing.csv")
    assert set(times["formulation"]) == {"dls"}


def test_the_oracle_has_an_id_of_its_own() -> None:
    """It is kept and not run again."""
    (planned,) = [
        p.id
        for p in expand(
            Study(description="o", cells=(Cells((ORACLE,)),), scenarios=(MISS,), plants=("ideal",))
        )
    ]
    assert len(planned) == 16


# --- the joint motions themselves


def test_following_a_circle_stays_on_it_with_the_position_alone() -> None:
    """A position-only task leaves the orientation free, and is followed to 1e-9."""
    robot = load_robot("panda")
    kinematics = Kinematics(robot)
    kinematics.update(robot.q0)
    reference = circle(kinematics.placement(robot.frame_id).copy(), 0.1, 1.0, 1.0)
    instants, tracking = np.linspace(0, 1, 41), PositionTask()
    turned = []
    followed = follow(robot, reference, robot.q0, instants, tracking)
    for q, tau in zip(followed, instants, strict=True):
        kinematics.update(q)
        X, X_d = kinematics.placement(robot.frame_id), reference.placement(tau)
        assert np.linalg.norm(X.translation - X_d.translation) < 1e-9
        turned.append(float(np.linalg.norm(pin.log3(X_d.rotation.T @ X.rotation))))
    assert max(turned) > 0.01
    motion = oracle_motion(robot, reference, robot.q0, instants, tracking)
    # Three rows have larger singular values than six.
    assert (
        motion.sigma_min.min() > oracle_motion(robot, reference, robot.q0, instants).sigma_min.min()
    )


def test_a_motion_in_closed_form_is_measured_as_it_is() -> None:
    """Speeds, margins and reach of a joint that turns at a constant rate."""
    robot = load_robot("planar3r")
    out = np.array([1.0, 0.0, 0.0])
    motion = joint_oracle(robot, lambda tau: robot.q0 + tau * out, np.linspace(0, 1, 11))
    assert motion.peak_speed_ratio == pytest.approx(0.5)  # of 2 rad/s
    assert motion.margin[0] == pytest.approx(2.8 - 1.6)
    assert motion.reach == pytest.approx(np.full(11, motion.reach[0]))
    assert motion.exact is not None
    assert motion.exact(0.5) == pytest.approx(robot.q0 + 0.5 * out)


def test_a_placement_is_solved_for_continuous_joints_too() -> None:
    """Kinova: nq = 9 and nv = 6."""
    robot = load_robot("kinova")
    kinematics = Kinematics(robot)
    kinematics.update(pin.integrate(robot.model, robot.q0, np.full(6, 0.3)))
    target = kinematics.placement(robot.frame_id).copy()
    kinematics.update(solve_placement(robot, target, robot.q0))
    error = pin.log6(kinematics.placement(robot.frame_id).actInv(target)).np
    assert np.abs(error).max() < 1e-9
