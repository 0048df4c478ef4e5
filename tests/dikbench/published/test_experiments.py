"""The files of published experiments, and the protocols that take seconds."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from makers.commands import in_process

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.published.agreement import Agreement
from dikbench.published.bargain import Bargain
from dikbench.published.circle import Circle
from dikbench.published.experiment import Experiment, load_experiment, published_experiments
from dikbench.published.lecture import Statements
from dikbench.published.measured import verdict
from dikbench.published.reproducing import Reproduced, _reproduced, measure_row, summary
from dikbench.published.twists import Twists
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot

HOME = (0.0, 0.0, 0.0, -1.57079, 0.0, 1.57079, -0.7853)


@pytest.mark.parametrize("name", published_experiments())
def test_every_row_can_be_run_or_says_why_not(name: str) -> None:
    """Formulations are built, settings are the protocol's, numbers have a column."""
    experiment = load_experiment(name)
    fields = experiment.protocol.__struct_fields__
    for row in experiment.rows:
        assert bool(row.formulation) != bool(row.not_covered), row.name
        assert set(row.published) <= set(experiment.statistics), row.name
        assert set(row.settings) <= set(fields), row.name
        for formulation in filter(None, (row.formulation, row.rival)):
            make_formulation(formulation)
        assert not row.rival or make_formulation(row.rival) != make_formulation(row.formulation)
        if row.formulation:
            assert msgspec.structs.replace(experiment.protocol, **row.settings)
    names = [row.name for row in experiment.rows]
    assert len({*names}) == len(names)


@pytest.mark.parametrize("name", ["lecture", "lecture-matrix", "log-derivative", "mink-warp"])
def test_what_takes_no_time_has_the_verdicts_that_are_committed(name: str) -> None:
    """The lecture's first null-space form is refuted, its other statements hold.

    Of mink-warp's circles the slow one comes out with counts that were fitted to it only.
    """
    refuted = {
        "dls, gentle",
        "v = v_1 + J_2^+ (V_2 - J_2 v_1) satisfies the primary task",
        "... and equals J_1^+ V_1 + (I - J_1^+ J_1) J_2^+ V_2",
    }
    experiment = load_experiment(name)
    for row in experiment.rows:
        if not row.formulation:
            continue
        said = verdict(experiment.statistics, row.published, experiment.measure(row)[0])
        assert said.startswith("not reproduced") == (row.name in refuted), (row.name, said)


def test_twists_succeed_where_the_velocity_fits() -> None:
    """The pseudo-inverse: where the least-norm velocity is inside the limits, and only there."""
    rules = Twists(robot="sawyer.urdf", frame="right_l6", count=60)
    found = rules.measure("pinv")
    robot = load_robot(str(published_experiments()["sns-ik"].parent / "sawyer.urdf"), "right_l6")
    random, position, limit = np.random.default_rng(0), robot.limits.position, robot.limits.velocity
    assert position is not None
    assert limit is not None
    q = random.uniform(position.lower, position.upper, (60, 7))
    v = random.uniform(limit.lower, limit.upper, (60, 7))
    kinematics, inside = Kinematics(robot), []
    for each, wanted in zip(q, v, strict=True):
        kinematics.update(each)
        J = kinematics.jacobian(robot.frame_id)
        inside.append(bool((np.abs(np.linalg.pinv(J) @ J @ wanted) <= limit.upper).all()))
    assert found["success"].value == pytest.approx(100 * np.mean(inside))
    assert 0 < np.mean(inside) < 1
    assert rules.measure("sns")["scaled"].value == 100


def test_the_circle_is_followed_by_damped_steps() -> None:
    """Against the same steps in numpy."""
    rules = Circle("panda", "panda_hand", HOME, point=0.09, steps=10, warm_up=5)
    robot = load_robot("panda", "panda_hand")
    kinematics, point = Kinematics(robot), pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.09]))
    q = home = np.array(HOME)
    kinematics.update(q)
    target = kinematics.placement(robot.frame_id) * point
    centre, errors = target.translation.copy(), []
    for k in range(15):
        X = kinematics.placement(robot.frame_id) * point
        angle = 2 * np.pi * 0.5 * k * 0.01
        target.translation = centre + 0.08 * np.array([np.cos(angle), 0, np.sin(angle)])
        e = pin.log6(X.actInv(target)).np
        J = pin.Jlog6(target.actInv(X)) @ point.toActionMatrixInverse()
        J = J @ kinematics.jacobian(robot.frame_id)
        H = J.T @ J + (1e-3 * (e @ e) + 1e-3 + 1e-4) * np.eye(7)
        q = q + np.linalg.solve(H, J.T @ e + 1e-4 * (home - q))
        kinematics.update(q)
        X = kinematics.placement(robot.frame_id) * point
        errors.append(np.linalg.norm(X.translation - target.translation))
    found = rules.measure("mink-qp[damping=0.03162277660168379,lm_damping=0.001]")
    assert found["mean"].value == pytest.approx(np.mean(errors[5:]), rel=1e-5)
    assert found["most"].value == pytest.approx(max(errors[5:]), rel=1e-5)


class _Inverse:
    def __init__(self, factor: float) -> None:
        self.factor = factor

    def inverse(self, J: Any) -> Any:
        return self.factor * np.linalg.pinv(J)


@pytest.mark.parametrize(("factor", "differing"), [(1.0, 0), (1.001, 20)])
def test_agreement_counts_the_states_that_differ(
    factor: float, differing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a package of our own that has the pseudo-inverse, or nearly."""
    monkeypatch.setitem(sys.modules, "made_up", SimpleNamespace(Inverse=_Inverse))
    rules = Agreement("made_up", "Inverse", "inverse", "", {"factor": factor}, count=20)
    assert rules.measure("pinv")["differing"].value == differing


def test_a_package_that_is_missing_is_said() -> None:
    """With the command that installs it."""
    rules = Agreement("no_such_package", "X", "y", "pip install no-such-package")
    with pytest.raises(DikbenchError, match="is not installed; pip install no-such-package"):
        rules.measure("pinv")


def test_statements_count_what_leaves_the_direction_and_the_limits() -> None:
    """Clipping leaves the direction, scaling does not; the pseudo-inverse leaves the limits."""
    rules = Statements(size=3.0, posture=False, count=30)
    clipped, scaled, free = (
        {name: each.value for name, each in rules.measure(law).items()}
        for law in ("pinv[after=clip]", "pinv[after=scale]", "pinv")
    )
    assert clipped["direction"] == free["limits"] > 20
    assert clipped["limits"] == scaled["limits"] == scaled["direction"] == 0
    assert free["first_task"] == free["stopped"] == 0


def test_the_bargain_of_damping_is_that_of_its_singular_values() -> None:
    """Of unit twists: speeds up to 1/(2 lambda), losses up to lambda^2/(s^2 + lambda^2)."""
    rules = Bargain("ur5", count=40)
    found = {name: each.value for name, each in rules.measure("dls[damping=0.05]").items()}
    assert 9.5 < found["speed"] <= 10
    assert 0 < found["away"] < found["near"] < 1
    assert found["away"] < 0.05**2 / (rules.near**2 + 0.05**2)
    exact = {name: each.value for name, each in rules.measure("pinv").items()}
    assert exact["near"] == pytest.approx(0, abs=1e-9)


def test_the_command_prints_and_writes_the_tables(tmp_path: Path) -> None:
    """Published beside measured, a verdict for each row and the command below."""
    out = tmp_path / "published.md"
    result = in_process("reproduce", "lecture-matrix", "--jobs", "1", "--out", str(out))
    assert result.exit_code == 0, result.output
    for text in (result.output, out.read_text(encoding="utf-8")):
        assert "| 0.000000 / 0.000000 | 10.000000 / 10.000000 | equal |" in text
        assert "dikbench reproduce lecture-matrix" in text
    assert r"\|v\| <= 1" in result.output


def test_an_unknown_experiment_is_refused() -> None:
    """With the nearest name."""
    result = in_process("reproduce", "lectur")
    assert result.exit_code == 2
    assert "did you mean 'lecture'?" in result.output + result.stderr


def test_a_folder_that_is_missing_is_refused_before_the_run(tmp_path: Path) -> None:
    """Not after minutes."""
    result = in_process("reproduce", "--out", str(tmp_path / "missing" / "published.md"))
    assert result.exit_code == 2
    assert "no such folder" in result.output + result.stderr


def test_every_experiment_is_listed() -> None:
    """Name, title and source on a line."""
    lines = in_process("list", "published").output.splitlines()
    assert [line.split()[0] for line in lines] == [*published_experiments()]


def test_an_experiment_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is done, its rows, what is known of it, and the command."""
    shown = in_process("show", "mink-warp").output
    experiment = load_experiment("mink-warp")
    for text in (experiment.source, *(row.name for row in experiment.rows), *experiment.notes):
        assert text in shown
    assert shown.rstrip().endswith("dikbench reproduce mink-warp")


def test_the_row_of_a_rival_says_whether_it_distinguishes_them() -> None:
    """On the matrix of the lecture: damping by nothing is the pseudo-inverse, by 0.05 it is not."""
    experiment = load_experiment("lecture-matrix")
    for damping, said in ((0.0, "equal; as for"), (0.05, "equal; not so for")):
        row = msgspec.structs.replace(experiment.rows[0], rival=f"dls[damping={damping}]")
        assert _reproduced(experiment, row, experiment.measure(row)).verdict.startswith(said)


def test_statements_hold_or_do_not_and_what_is_fitted_is_said() -> None:
    """Neither is counted among the tables that came out."""
    experiment = load_experiment("lecture-matrix")
    stated = msgspec.structs.replace(experiment, statements=True)
    row = experiment.rows[0]
    wrong = msgspec.structs.replace(row, formulation="dls")
    words = [_reproduced(stated, each, stated.measure(each)).verdict for each in (row, wrong)]
    assert words == ["holds", "does not hold: v_2"]
    fitted = msgspec.structs.replace(row, fitted=True)
    assert _reproduced(experiment, fitted, experiment.measure(fitted)).verdict == "fitted: equal"
    rows = [_reproduced(stated, each, stated.measure(each)) for each in (row, wrong)]
    assert summary({"x": rows}) == "1 does not hold, 1 holds"


def test_where_nothing_is_measured_the_exit_code_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that is not installed is no lack of a formulation here."""
    rows = [Reproduced(load_experiment("jparse").rows[0], None, "not measured: x is not installed")]
    monkeypatch.setattr(
        "dikbench.published.reproducing.reproduce", lambda names, jobs: iter([("jparse", rows)])
    )
    result = in_process("reproduce", "jparse")
    assert result.exit_code == 3
    assert "1 not measured" in result.output


def test_what_a_worker_cannot_measure_is_not_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reason stands in the row; published numbers stay."""
    experiment = load_experiment("jparse")
    missing = msgspec.structs.replace(experiment.protocol, module="no_such_package")
    broken: Experiment = msgspec.structs.replace(experiment, protocol=missing)
    monkeypatch.setattr("dikbench.published.reproducing.load_experiment", lambda name: broken)
    found = measure_row("jparse", 0)
    assert "not installed" in str(found)
    said = _reproduced(broken, broken.rows[0], found).verdict
    assert said.startswith("not measured: no_such_package")
