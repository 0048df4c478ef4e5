from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from makers.rows import make_rows, write_results

from dikbench.cli import commands
from dikbench.metrics import METRICS
from dikbench.report.write import write_report


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


SCENARIOS = ("reach", "near-miss[miss=0.02]")


@pytest.mark.parametrize(
    ("statuses", "said"),
    [
        ({"pinv": ["ok", "ok"], "dls": ["ok", "ok"]}, "No trial failed"),
        ({"pinv": ["ok", "ok"], "dls": ["ok", "timeout"]}, "`dls`: 50 % of the trials"),
        ({"pinv": ["crashed", "timeout"], "dls": ["timeout", "crashed"]}, "100 % of the trials"),
        ({"pinv": ["skipped", "skipped"], "dls": ["skipped", "skipped"]}, "No formulation was run"),
        ({"pinv": ["timeout", "skipped"], "dls": ["ok", "skipped"]}, "`pinv`: 100 % of the trials"),
        ({"dls": ["ok", "ok"]}, "No trial failed"),
        ({"dls": ["ok", "crashed"]}, "`dls`: 50 % of the trials"),
        ({"dls": ["crashed", "crashed"]}, "`dls`: 100 % of the trials"),
        ({"dls": ["skipped", "skipped"]}, "No formulation was run"),
    ],
)
def test_a_report_is_made_whatever_failed(
    tmp_path: Path, statuses: dict[str, list[str]], said: str
) -> None:
    """Of no, one and all trials failed or skipped, of two formulations and of one."""
    rows = make_rows({name: {"status": status} for name, status in statuses.items()}, SCENARIOS)
    rows.loc[rows["status"].ne("ok"), list(METRICS)] = np.nan
    folder = write_results(tmp_path / "out", rows)
    write_report(folder)
    assert said in (folder / "report.md").read_text()


def test_a_report_is_made_where_plant_and_reference_were_not_crossed(tmp_path: Path) -> None:
    """The ideal plant with one reference, the other plant with the other."""
    rows = make_rows({"pinv": {}, "dls": {}}, SCENARIOS, reference="path")
    half = rows["scenario"].eq("reach")
    rows.loc[half, "plant"], rows.loc[half, "reference"] = "saturating", "time"
    folder = write_results(tmp_path / "out", rows)
    write_report(folder)
    assert "the ideal plant" in (folder / "report.md").read_text()
