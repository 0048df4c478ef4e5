"""Peers beside their counterparts, with one that needs no other library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from makers.runs import run_here, without_figures
from makers.scenarios import error_of

from dikbench.report.sentences.peers_alone import without_counterpart
from dikbench.report.tables.peers import peers_table, write_peers_tables
from dikbench.report.write import write_report
from dikbench.results.peers import COLUMNS, FILE, read_peers, write_peers
from dikbench.run.in_workers import RunSettings
from dikbench.run.peers import compare_with_peers, pairs_of, with_ticks
from dikbench.run.timing import Contender
from dikbench.selector import parse_selector
from dikbench.study.study import load_study

PEER = '''
from dataclasses import dataclass
from typing import Annotated, ClassVar
import numpy as np
from dikbench.errors import SolverFailed
from dikbench.problem import Parameters, Range
from formulations.damped_least_squares import DampedLeastSquares


@dataclass(frozen=True)
class Other(Parameters):
    """A library that adds to the first joint, for a reason where it is fast, or is silent there."""

    off: Annotated[float, Range(0.0)] = 0.0
    silent: bool = False

    computes_kinematics: ClassVar[bool] = True
    counterpart: ClassVar[str] = "dls[damping=0.1]"
    package: ClassVar[str] = "numpy"

    def known_difference(self, problem, velocity):
        if velocity is None:
            return "it is silent"
        return "it is fast" if self.fast(problem) else ""

    def fast(self, problem):
        return np.linalg.norm(problem.primary.V) > 0.5

    def velocity(self, problem, solve):
        v = DampedLeastSquares(damping=0.1).velocity(problem, solve)
        if self.silent and self.fast(problem):
            raise SolverFailed("it is silent")
        return v + self.off * (np.arange(len(v)) == 0)
'''
SCENARIO = "reach[duration=0.3]"


@pytest.fixture
def other(tmp_path: Path) -> str:
    """The peer's selector."""
    file = tmp_path / "other.py"
    file.write_text(PEER)
    return f"{file}:Other"


def cells(*formulations: str) -> list[Contender]:
    """Cells without a solver."""
    return [(parse_selector(name), parse_selector("none")) for name in formulations]


def test_a_peer_is_paired_with_equal_formulations_alone(other: str) -> None:
    """Whatever their selectors look like; others, and peers of others, are left alone."""
    found = pairs_of(cells(other, "dls", "dls[damping=0.10]", "pinv", "qp"))
    assert [(str(peer[0]), str(ours[0])) for peer, ours in found] == [(other, "dls[damping=0.10]")]
    assert pairs_of(cells("dls", "pinv")) == []
    assert pairs_of(cells(other, "dls")) == []


@pytest.mark.parametrize("off", [0.0, 1e-7, 1e-3, 2.0])
def test_the_largest_difference_and_its_reasons(other: str, off: float) -> None:
    """An offset is found as it is; what no reason is known of is said, small ones need none."""
    pairs = pairs_of(cells(f"{other}[off={off}]", "dls[damping=0.1]"))
    (row,) = compare_with_peers(parse_selector(SCENARIO), 0, pairs)
    assert row["velocity_difference_max_rad_s"] == pytest.approx(off, rel=1e-6, abs=1e-15)
    assert row["peer_version"] == np.__version__
    assert row["steps"] > 10
    said = row["explained_by"]
    assert ("steps)" in said) == (off > 1e-6)
    counted = [int(part.rpartition("(")[2].split()[0]) for part in said.split("; ") if part]
    assert sum(counted) == (row["steps"] if off > 1e-6 else 0)
    assert ("it is fast" in said) == ("no reason is known" in said) == (off > 1e-6)


def test_steps_without_an_answer_are_counted_apart(other: str) -> None:
    """They are not compared; the reason is the peer's."""
    pairs = pairs_of(cells(other, f"{other}[silent=true]", "dls[damping=0.1]"))
    every, some = compare_with_peers(parse_selector(SCENARIO), 0, pairs)
    silent = every["steps"] - some["steps"]
    assert 0 < silent < every["steps"]
    assert some["explained_by"] == f"no answer: it is silent ({silent} steps)"


@pytest.mark.parametrize("stability", ["stable", "drift: ..."])
def test_ticks_are_whole(stability: str) -> None:
    """Kinematics are added; a peer's own are in its call, so that none are; both are stable."""
    times: list[dict[str, Any]] = [
        {"formulation": "a", "solver": "daqp", "kinematics_time_median_us": 10.0,
         "formulation_time_median_us": 20.0, "timing_stability": "stable"},
        {"formulation": "peer", "solver": "none", "kinematics_time_median_us": 0.0,
         "formulation_time_median_us": 90.0, "timing_stability": stability},
        {"formulation": "refused", "solver": "none"},
    ]  # fmt: skip
    (row,) = with_ticks([{"formulation": "a", "solver": "daqp", "peer": "peer"}], times)
    assert (row["our_tick_median_us"], row["peer_tick_median_us"]) == (30.0, 90.0)
    assert row["ticks_stable"] == (stability == "stable")
    (row,) = with_ticks([{"formulation": "a", "solver": "daqp", "peer": "refused"}], times)
    assert row["peer_tick_median_us"] is None
    assert "ticks_stable" not in row


def test_a_peer_that_is_compared_with_nothing_is_named(other: str) -> None:
    """With the formulation to add, however it is written there; one that is gone is passed over."""
    assert without_counterpart([other, "pinv", "gone.py:Law"]) == {other: "dls[damping=0.1]"}
    assert without_counterpart([other, "dls[damping=0.10]"]) == {}
    assert without_counterpart(["dls", "pinv"]) == {}


def rows(difference: float) -> list[dict[str, object]]:
    """One row of a comparison."""
    return [
        {
            "formulation": "dls", "peer": "peer", "scenario": "reach", "solver": "none",
            "peer_version": "1.0", "steps": 7, "velocity_difference_max_rad_s": difference,
            "explained_by": "it is loose (2 steps)", "our_tick_median_us": 5.0,
            "peer_tick_median_us": 10.0, "ticks_stable": 1.0 if difference < 2 else 0.0,
        }
    ]  # fmt: skip


def test_what_is_written_is_read_and_replaced(tmp_path: Path) -> None:
    """A row of the same keys takes the place of the old one, others stay."""
    assert read_peers(tmp_path).empty
    write_peers(tmp_path, [])
    assert not (tmp_path / FILE).exists()
    write_peers(tmp_path, rows(1.0))
    write_peers(tmp_path, [{**row, "scenario": "step"} for row in rows(2.0)])
    write_peers(tmp_path, rows(3.0))
    found = read_peers(tmp_path)
    assert list(found.columns) == list(COLUMNS)
    assert found["velocity_difference_max_rad_s"].tolist() == [3.0, 2.0]
    (tmp_path / FILE).write_text("a,b\n1,2\n")
    assert "not a comparison with peers" in error_of(read_peers, tmp_path)


def test_tables_of_peers(tmp_path: Path) -> None:
    """A row per peer over scenarios, counts of steps left out; files only where there are rows."""
    frame = pd.DataFrame([*rows(1.0), *({**row, "scenario": "step"} for row in rows(2.0))])
    (row,) = peers_table(frame).to_dict("records")
    assert (row["scenarios"], row["steps"], row["why"]) == (2, 14, "it is loose")
    assert (row["largest difference [rad/s]"], row["ratio"]) == (2.0, 0.5)
    assert row["stable"] == "1 of 2"
    write_peers_tables(frame.iloc[:0], tmp_path / "none")
    assert not (tmp_path / "none").exists()
    write_peers_tables(frame, tmp_path / "tables")
    cost = pd.read_csv(tmp_path / "tables" / "peer_cost.csv")
    assert cost["ratio"].tolist() == [0.5, 0.5]
    assert cost["stable"].tolist() == ["yes", "no"]
    agreement = pd.read_csv(tmp_path / "tables" / "peer_agreement.csv")
    assert agreement["explained_by"].tolist() == ["it is loose (2 steps)"] * 2
    assert agreement["steps"].tolist() == [7, 7]


def test_a_run_with_a_peer_has_the_section_and_one_without_has_not(
    other: str, tmp_path: Path
) -> None:
    """From the study to the report; a peer's kinematics are its own, so that none are added."""
    study = tmp_path / "mine.toml"
    text = (
        'description = "Mine"\nplants = ["ideal"]\nscenarios = ["{}"]\n[[cells]]\n'
        "formulations = {}\n[timing]\nreference = 'dls'\nproblems = 3\nrounds = 2\n"
    )
    for out, formulations in (("with", ["dls[damping=0.1]", other]), ("without", ["dls", "pinv"])):
        study.write_text(text.format(SCENARIO, formulations))
        folder = run_here(load_study(str(study)), tmp_path / out, RunSettings(jobs=1), "test").path
        with without_figures():
            write_report(folder)
        assert ("Other libraries" in (folder / "report.md").read_text()) == (out == "with")
        assert ('id="peers"' in (folder / "report.html").read_text()) == (out == "with")
        assert (folder / "tables" / "peer_agreement.csv").exists() == (out == "with")
    times = pd.read_csv(tmp_path / "with" / "timing.csv").set_index("formulation")
    kinematics = times["kinematics_time_median_us"]
    assert kinematics[other] == 0
    assert kinematics["dls[damping=0.1]"] > 0
    (row,) = read_peers(tmp_path / "with").to_dict("records")
    assert row["peer_tick_median_us"] == times["formulation_time_median_us"][other]
