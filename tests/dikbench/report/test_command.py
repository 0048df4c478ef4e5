from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from makers.rows import make_rows, write_results
from makers.runs import without_figures

from dikbench.cli import commands
from dikbench.metrics import METRICS, OUTCOME_NUMBERS, OUTCOME_TEXTS
from dikbench.report.write import write_report

pytestmark = pytest.mark.usefixtures("drawn")  # without PNGs


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
        f"error: no results in {tmp_path}: none of results.sqlite, trials.parquet and trials.csv "
        "is there\n"
    )


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    """A file in the place of the figures is named as the reason."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "figures").write_text("")
    answer = CliRunner().invoke(commands, ["report", str(folder)])
    assert answer.exit_code == 2
    assert answer.stderr == f"error: report in {folder} cannot be written: File exists\n"


SCENARIOS = ("reach", "near-miss[miss=0.02]")


BROKEN = {"ok": "success", "skipped": ""}


@pytest.mark.parametrize(
    ("statuses", "said"),
    [
        ({"pinv": ["ok", "ok"], "dls": ["ok", "ok"]}, "that a known motion can do"),
        ({"pinv": ["ok", "ok"], "dls": ["ok", "timeout"]}, "`dls` in 1 of 2 trials (1 timeout)"),
        ({"pinv": ["crashed", "timeout"], "dls": ["timeout", "crashed"]}, "`pinv` in 2 of 2"),
        ({"pinv": ["skipped", "skipped"], "dls": ["skipped", "skipped"]}, "No formulation was run"),
        ({"pinv": ["timeout", "skipped"], "dls": ["ok", "skipped"]}, "`pinv` in 1 of 1 trials"),
        pytest.param({"dls": ["ok", "ok"]}, "that a known motion can do", marks=pytest.mark.long),
        ({"dls": ["ok", "crashed"]}, "`dls` in 1 of 2 trials (1 crashed)"),
        pytest.param(
            {"dls": ["crashed", "crashed"]},
            "`dls` in 2 of 2 trials (2 crashed)",
            marks=pytest.mark.long,
        ),
        ({"dls": ["skipped", "skipped"]}, "No formulation was run"),
    ],
)
def test_a_report_is_made_whatever_failed(
    tmp_path: Path, statuses: dict[str, list[str]], said: str
) -> None:
    """Of no, one and all trials failed or skipped, of two formulations and of one.

    With its figures once; they have tests of their own.
    """
    rows = make_rows({name: {"status": status} for name, status in statuses.items()}, SCENARIOS)
    rows["outcome"] = [BROKEN.get(status, "did-not-run") for status in rows["status"]]
    rows.loc[rows["status"].ne("ok"), list(METRICS)] = np.nan
    folder = write_results(tmp_path / "out", rows)
    with nullcontext() if "1 timeout" in said else without_figures():
        write_report(folder)
    assert said in (folder / "report.md").read_text()


def test_results_without_outcomes_have_a_report_that_concludes_nothing(tmp_path: Path) -> None:
    """As the first release committed them: one sentence says so, and nothing is starred."""
    rows = make_rows({"pinv": {}, "dls": {}}, SCENARIOS).drop(
        columns=[*OUTCOME_TEXTS, *OUTCOME_NUMBERS, "slow_down", "contour_error_6d_max_m"]
    )
    folder = write_results(tmp_path / "out", rows)
    printed = write_report(folder)
    text = (folder / "report.md").read_text()
    assert "nothing is concluded from them" in text
    assert "Nothing can be said of success" in text
    assert "Nothing can be said of success" in printed
    assert "First" not in text
    assert "**" not in text.partition("## Tracking error")[2].partition("## Limitations")[0]


def test_a_report_is_made_where_plant_and_reference_were_not_crossed(tmp_path: Path) -> None:
    """The ideal plant with one reference, the other plant with the other."""
    rows = make_rows({"pinv": {}, "dls": {}}, SCENARIOS, reference="path")
    half = rows["scenario"].eq("reach")
    rows.loc[half, "plant"], rows.loc[half, "reference"] = "saturating", "time"
    folder = write_results(tmp_path / "out", rows)
    write_report(folder)
    assert "Success on the ideal plant" in (folder / "report.md").read_text()
