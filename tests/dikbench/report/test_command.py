from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner
from makers.rows import make_rows, write_results

from dikbench.cli import commands


def test_a_report_is_remade_by_its_command(tmp_path: Path) -> None:
    """It prints the tables and where the page is; made twice it is the same."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}, "dls": {}}))
    pages = []
    for _ in range(2):
        answer = CliRunner().invoke(commands, ["report", str(folder)])
        assert answer.exit_code == 0, answer.output
        assert answer.output.endswith(f"{folder / 'report.html'}\n")
        pages.append((folder / "report.html").read_bytes())
    assert pages[0] == pages[1]


def test_a_folder_without_results_is_one_line_on_stderr(tmp_path: Path) -> None:
    """Exit code 2, the folder and what was looked for."""
    answer = CliRunner().invoke(commands, ["report", str(tmp_path)])
    assert answer.exit_code == 2
    assert answer.stderr == (
        f"error: no results in {tmp_path}: neither results.sqlite nor trials.csv is there\n"
    )


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    """A file in the place of the figures is named as the reason."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "figures").write_text("")
    answer = CliRunner().invoke(commands, ["report", str(folder)])
    assert answer.exit_code == 2
    assert answer.stderr == f"error: report in {folder} cannot be written: File exists\n"
