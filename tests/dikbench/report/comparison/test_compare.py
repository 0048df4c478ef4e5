"""`dikbench compare`: what is said first, exit codes, messages, files."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from makers.rows import make_rows, write_results
from makers.runs import run_here

from dikbench.cli import commands
from dikbench.metrics import METRICS
from dikbench.report.comparison.comparison import compare
from dikbench.run.in_workers import RunSettings
from dikbench.study.study import Cells, Study

OLD = Path(__file__).parents[3] / "data" / "first_release"


def dikbench(*arguments: object) -> Result:
    """`dikbench compare` with the arguments."""
    return CliRunner().invoke(commands, ["compare", *map(str, arguments)])


def lines_of(result: Result) -> list[str]:
    """The rows of the table of metrics, the heading left out."""
    _, _, text = result.output.partition("## Metrics\n\n")
    return [line for line in text.partition("\n\n")[0].splitlines() if line.startswith("| ")][1:]


def test_a_folder_does_not_differ_from_itself() -> None:
    """Old results against themselves: nothing to tell, exit code 0, guarded or not."""
    plain = dikbench(OLD, OLD)
    guarded = dikbench(OLD, OLD, "--tolerance", "position_error_rms_m=0")
    assert plain.exit_code == guarded.exit_code == 0
    assert plain.output.startswith("No difference.\n")
    assert guarded.output.startswith("Within tolerance: no difference.\n")
    for title in ("Status", "Metrics", "Not compared", "Versions"):
        assert f"## {title}" not in plain.output


def test_a_store_does_not_differ_from_its_exports(tmp_path: Path) -> None:
    """A real run against its own CSV file, without store and traces: not a bit is lost."""
    study = Study("a test", (Cells(("dls", "pinv")),), ("reach[duration=0.2]",), name="tiny")
    run_here(study, tmp_path / "a", RunSettings(jobs=1), "a test")
    (tmp_path / "b").mkdir()
    for name in ("trials.csv", "manifest.json"):
        shutil.copy(tmp_path / "a" / name, tmp_path / "b")
    found = compare(tmp_path / "a", tmp_path / "b")
    assert found.formulations.empty
    assert found.trials().empty
    assert len(found.matched.a) == 4


def test_a_tampered_metric_is_the_first_line(folder: Callable[..., Path]) -> None:
    """One trial of twelve 10 % worse: named before an improvement, beyond 5 % but not 20 %."""

    def tamper(table: pd.DataFrame) -> None:
        table.loc[9, "velocity_peak_ratio"] = 0.55
        table.loc[3, "position_error_rms_m"] = 0.1

    a, b = folder("a"), folder("b", tamper)
    result = dikbench(a, b, "--tolerance", "velocity_peak_ratio=5%")
    assert result.exit_code == 1
    assert result.output.startswith("REGRESSED: 1 beyond tolerance.\n")
    first, second = lines_of(result)
    assert [cell.strip() for cell in first.split("|")[1:4]] == ["velocity_peak_ratio", "qp", "daqp"]
    assert "near-miss[miss=0.1] seed 1" in first
    assert "position_error_rms_m" in second
    for within in ("velocity_peak_ratio=20%", "velocity_peak_ratio=0.06", "sigma_min=0"):
        assert dikbench(a, b, "--tolerance", within).exit_code == 0
    several = dikbench(a, b, "--tolerance", "sigma_min=0", "--tolerance", "velocity_peak_ratio=0")
    assert several.exit_code == 1
    assert dikbench(a, b).exit_code == 0


def test_what_is_beyond_a_tolerance_comes_before_what_is_worse(folder: Callable[..., Path]) -> None:
    """A metric that nobody guards may become much worse without hiding one that is guarded."""

    def change(table: pd.DataFrame) -> None:
        table.loc[:2, "position_error_rms_m"] = [9.0, 0.1, 0.5]
        table.loc[3, "sigma_min"] = 0.49
        table.loc[4, "joint_travel_rad"] = 0.1

    a, b = folder("a"), folder("b", change)

    def order(*options: str) -> list[str]:
        return [line.split("|")[1].strip() for line in lines_of(dikbench(a, b, *options))]

    assert order() == ["position_error_rms_m", "sigma_min", "joint_travel_rad"]
    guarded = order("--tolerance", "sigma_min=1%")
    assert guarded == ["sigma_min", "position_error_rms_m", "joint_travel_rad"]


def test_one_seed_of_one_scenario_has_no_interval(folder: Callable[..., Path]) -> None:
    """A single trial says nothing of others: its difference stands there without an interval."""
    a = folder("a", lambda table: table.head(1))
    b = folder("b", lambda table: table.head(1).assign(sigma_min=0.4))
    result = dikbench(a, b)
    assert result.exit_code == 0
    (line,) = lines_of(result)
    cells = [cell.strip() for cell in line.split("|")]
    assert "-0.1" in cells
    assert "" in cells[1:-1]
    assert "nan" not in result.output


def test_undefined_on_one_side_is_a_change(folder: Callable[..., Path]) -> None:
    """NaN on both sides is silent; a value that B no longer has exceeds every tolerance."""

    def lose(table: pd.DataFrame) -> None:
        table.loc[0, "sigma_min"] = np.nan

    a, b, c = folder("a"), folder("b", lose), folder("c", lose)
    assert compare(b, c).formulations.empty
    lost, found = compare(a, b), compare(b, a)
    assert (lost.formulations["worse"].item(), found.formulations["worse"].item()) == (1, 0)
    assert "undefined" in lines_of(dikbench(a, b))[0]
    assert dikbench(a, b, "--tolerance", "sigma_min=1e6%").exit_code == 1
    assert dikbench(b, a, "--tolerance", "sigma_min=0").exit_code == 0


def test_newly_failed_trials_come_before_all_numbers(folder: Callable[..., Path]) -> None:
    """With any tolerance they are a regression; their numbers are not compared."""

    def fail(table: pd.DataFrame) -> None:
        table.loc[4, ["status", "message"]] = ["diverged", "step 7: too fast"]
        table.loc[5, "status"] = "skipped"
        table.loc[4, "sigma_min"] = 0.0
        table.loc[11, "sigma_min"] = 0.4

    a, b = folder("a"), folder("b", fail)
    result = dikbench(a, b, "--tolerance", "position_error_rms_m=1")
    assert result.exit_code == 1
    assert result.output.startswith("REGRESSED: 2 trials newly failed.\n")
    assert (
        "ok -> diverged: dls on near-miss[miss=0.2] (ideal plant, time, seed 0): step 7: too"
        in (result.output)
    )
    assert result.output.index("## Status") < result.output.index("## Metrics")
    assert [line for line in lines_of(result) if "dls" in line] == []
    assert dikbench(a, b).exit_code == 0
    mended = dikbench(b, a, "--tolerance", "position_error_rms_m=1")
    assert mended.exit_code == 0
    assert "diverged -> ok" in mended.output
    assert [line for line in lines_of(mended) if "dls" in line] == []


def test_trials_of_one_folder_are_counted_and_named(folder: Callable[..., Path]) -> None:
    """What only B ran is no regression, what only A ran is one; neither is hidden."""
    a = folder("a", lambda table: table.drop(index=[0, 1, 2]))
    b = folder("b", lambda table: table.drop(index=[11]))
    result = dikbench(a, b, "--tolerance", "sigma_min=0")
    assert result.exit_code == 1
    assert result.output.startswith("REGRESSED: 1 trial of A missing in B.\n")
    assert (
        dikbench(folder("c", lambda t: t.head(3)), b, "--tolerance", "sigma_min=0").exit_code == 0
    )
    assert "8 trials in both" in result.output
    assert "1 trial is in A only" in result.output
    assert "- qp with daqp on near-miss[miss=0.2] (ideal plant, time, seed 1)" in result.output
    assert "3 trials are in B only" in result.output
    assert "- dls on near-miss[miss=0.1] (ideal plant, time, seed 0)" in result.output


def test_columns_of_other_versions(folder: Callable[..., Path]) -> None:
    """What one side lacks is said, not compared, and no tolerance can be put on it."""
    a = folder("a", lambda table: table.drop(columns=["sigma_min", "timing_stability"]))
    b = folder("b", lambda table: table.assign(metric_of_tomorrow=1.0))
    result = dikbench(a, b)
    assert result.exit_code == 0
    assert "B has metric_of_tomorrow, sigma_min, timing_stability, which A lacks." in result.output
    assert "## Times" not in result.output
    wrong = dikbench(a, b, "--tolerance", "sigma_min=1")
    assert wrong.exit_code == 2
    assert "one of the folders lacks this metric" in wrong.output


def test_files_hold_every_row(folder: Callable[..., Path], tmp_path: Path) -> None:
    """The Markdown file has what the console cut off, the CSV file every trial's difference."""

    def change(table: pd.DataFrame) -> None:
        table[[*METRICS]] += np.random.default_rng(0).uniform(-0.1, 0.1, (12, len(METRICS)))

    a, b = folder("a"), folder("b", change)
    result = dikbench(a, b, "--out", tmp_path / "x.md")
    assert result.exit_code == 0
    assert len(lines_of(result)) == 20
    assert f"and {2 * len(METRICS) - 20} more" in result.output
    text = (tmp_path / "x.md").read_text()
    assert all(f"| {name} " in text for name in METRICS)
    assert "more" not in text
    assert dikbench(a, b, "--out", tmp_path / "x.csv").exit_code == 0
    table = pd.read_csv(tmp_path / "x.csv")
    assert len(table) == 12 * len(METRICS)
    np.testing.assert_allclose(table["b"] - table["a"], table["difference"], atol=1e-12)
    assert table["worsening"].is_monotonic_decreasing


@pytest.mark.parametrize(
    ("tolerance", "message"),
    [
        ("position_error_rms=1", "did you mean 'position_error_rms_m'"),
        ("position_error_rms_m", "not of the form METRIC=VALUE"),
        ("position_error_rms_m=", "not of the form"),
        ("position_error_rms_m=x", "not of the form"),
        ("position_error_rms_m=-1", "not of the form"),
        ("position_error_rms_m=nan", "not of the form"),
        ("position_error_rms_m=inf", "not of the form"),
        ("position_error_rms_m=%", "not of the form"),
        ("=1", "unknown metric ''"),
    ],
)
def test_malformed_tolerances(tolerance: str, message: str) -> None:
    """One line, exit code 2, and what would be valid."""
    result = dikbench(OLD, OLD, "--tolerance", tolerance)
    assert result.exit_code == 2
    assert result.output.startswith("error: ")
    assert result.output.count("\n") == 1
    assert message in result.output


def test_what_cannot_be_compared(folder: Callable[..., Path], tmp_path: Path) -> None:
    """No results, nothing in common, a trial twice, no trials, a file with another ending."""
    a = folder("a")
    others = {
        tmp_path: "no results in",
        folder("seeds", lambda t: t.assign(seed=t["seed"] + 7, id=t["id"] + "7")): (
            "have no trial in common"
        ),
        folder("twice", lambda t: pd.concat([t, t])): "holds a trial twice: dls on reach",
        folder("empty", lambda t: t.head(0)): "holds no trials",
        folder("bare", lambda t: t.drop(columns=[*METRICS])): "have no metric in common",
    }
    for other, message in others.items():
        result = dikbench(a, other)
        assert (result.exit_code, result.output.count("\n")) == (2, 1)
        assert message in result.output
    result = dikbench(a, a, "--out", tmp_path / "x.txt")
    assert (result.exit_code, result.output) == (
        2,
        f"error: file {tmp_path / 'x.txt'}: valid endings: .md, .csv\n",
    )
    assert dikbench(a, a, "--out", tmp_path / "missing" / "x.md").exit_code == 2


def test_cells_that_both_skipped_are_no_trials_in_both(tmp_path: Path) -> None:
    """They are counted apart."""
    rows = make_rows({"a": {}, "b": {"status": "skipped", "outcome": ""}}, ("reach", "step"))
    said = dikbench(write_results(tmp_path / "a", rows), tmp_path / "a").output
    assert "2 trials in both, of which 2 ended ok in both. 2 cells skipped in both." in said


def _with_own(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(ease=0.5, toil=0.5)


def _described(**best: str) -> dict[str, dict[str, str]]:
    return {name: {"selector": f"m.py:{name}", "best": value} for name, value in best.items()}


@pytest.mark.parametrize(("metric", "worse"), [("ease", 0.4), ("toil", 0.6)])
def test_metrics_of_others_are_compared_in_their_direction(
    folder: Callable[..., Path], metric: str, worse: float
) -> None:
    """What is best of them says the manifest; they have tolerances like those of dikbench."""

    def tamper(rows: pd.DataFrame) -> pd.DataFrame:
        changed = _with_own(rows)
        changed.loc[9, metric] = worse
        return changed

    described = _described(ease="high", toil="low")
    a, b = folder("a", _with_own, metrics=described), folder("b", tamper, metrics=described)
    for first, second, code in ((a, b, 1), (b, a, 0)):
        assert dikbench(first, second, "--tolerance", f"{metric}=0.05").exit_code == code
    assert dikbench(a, b, "--tolerance", f"{metric}=0.15").exit_code == 0
    [line] = lines_of(dikbench(a, b))
    assert line.split("|")[1].strip() == metric


def test_a_metric_that_one_folder_lacks_has_no_tolerance(folder: Callable[..., Path]) -> None:
    """Nor one of which the two say otherwise what is best, nor one that nobody knows."""
    described = _described(ease="high", toil="low")
    a = folder("a", _with_own, metrics=described)
    other = folder("other", _with_own, metrics=_described(ease="low", toil="low"))
    for b, name, said in (
        (folder("b"), "ease", "one of the folders lacks this metric"),
        (other, "ease", "one of the folders lacks this metric"),
        (other, "sloth", "unknown metric 'sloth'"),
    ):
        done = dikbench(a, b, "--tolerance", f"{name}=0.1")
        assert done.exit_code == 2
        assert said in done.output
