"""`dikbench table`: chosen columns and formulations, under names of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from makers.rows import Values, make_rows, write_results

from dikbench.cli import commands


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Results of three formulations, one of them with two parameters."""
    formulations: dict[str | tuple[str, str], Values] = {
        "dls[damping=0.1,gain=2]": {},
        "pinv": {"outcome": "late"},
        "lp": {},
    }
    return write_results(tmp_path / "out", make_rows(formulations, ("reach", "step")))


def _table(*options: str) -> Result:
    return CliRunner().invoke(commands, ["table", *options])


def test_columns_and_formulations_are_chosen_in_the_order_given(folder: Path) -> None:
    """Commas inside brackets belong to a selector; keys of CSV and headings both name columns."""
    answer = _table(
        str(folder), "--format", "markdown", "--columns", "trials,free_space_percent",
        "--formulations", "lp,dls[damping=0.1,gain=2]",
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    lines = answer.output.splitlines()
    assert [cell.strip() for cell in lines[2].split("|")[1:-1]] == [
        "formulation", "solver", "trials", "free space",
    ]  # fmt: skip
    assert [line.split("|")[1].strip() for line in lines[4:6]] == ["lp", "dls[damping=0.1,gain=2]"]
    assert lines[-1] == (
        "Too few cases for stars: free space (2 scenarios). "
        "Samples: free space: 2 scenarios of one robot, ur5."
    )


def test_a_table_without_rows_says_why(tmp_path: Path) -> None:
    """And not that the formulations of the run are unknown."""
    nothing_known = make_rows({"dls": {"feasible": "unknown"}})
    folder = write_results(tmp_path / "out", nothing_known)
    answer = _table(str(folder), "--table", "success", "--formulations", "dls")
    assert answer.exit_code == 2
    assert "the table success has no rows: Nothing can be said of success" in answer.stderr


def test_names_of_ones_own(folder: Path, tmp_path: Path) -> None:
    """In every format; what has none keeps its own."""
    names = tmp_path / "names.toml"
    names.write_text(
        '[formulations]\n"dls[damping=0.1,gain=2]" = "Damped 50%"\n[solvers]\nnone = "-"\n'
        '[columns]\nall_percent = "overall"\n'
    )
    latex = _table(str(folder), "--names", str(names)).output
    assert r"Damped 50\% & 100 & 100 & 2" in latex.replace(r"\textbf{100}", "100")
    assert r"\rotatebox{90}{overall}" in latex
    markdown = _table(str(folder), "--names", str(names), "--format", "markdown").output
    assert "| Damped 50%" in markdown
    csv = _table(str(folder), "--names", str(names), "--format", "csv").output
    assert "all,ideal,time,Damped 50%,-," in csv
    assert "all,ideal,time,pinv,-," in csv
    assert "all_percent" in csv


@pytest.mark.parametrize(
    "name", ["outcomes", "tracking_error", "limit_violation", "timing", "solvers"]
)
def test_every_table_can_be_had(tmp_path: Path, name: str) -> None:
    """As LaTeX, which is the default."""
    timed = {"formulation_time_median_us": 10.0, "timing_stability": "stable"}
    folder = write_results(tmp_path / "out", make_rows({("lp", "daqp"): timed}))
    answer = _table(str(folder), "--table", name)
    assert answer.exit_code == 0, answer.output
    assert r"\begin{tabular}" in answer.output


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--table", "sucess"), "success"),
        (("--columns", "al"), "all_percent"),
        (("--formulations", "pin"), "pinv"),
        (("--names", "nowhere.toml"), "No such file"),
    ],
)
def test_mistakes_are_one_line(folder: Path, options: tuple[str, ...], said: str) -> None:
    """Exit code 2, and what would be valid."""
    answer = _table(str(folder), *options)
    assert answer.exit_code == 2
    assert said in answer.stderr
    assert len(answer.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "text", ["formulations = 3", "[columns]\nall_percent = 3", "[[[", "[formulation]\na = 'b'"]
)
def test_a_file_of_names_that_is_none_is_one_line(folder: Path, tmp_path: Path, text: str) -> None:
    """It says what would be valid."""
    names = tmp_path / "names.toml"
    names.write_text(text)
    answer = _table(str(folder), "--names", str(names))
    assert answer.exit_code == 2
    assert "valid: tables [formulations], [solvers] and [columns]" in answer.stderr
    assert len(answer.stderr.splitlines()) == 1
