"""The notebooks run as scripts, and say what they mean to show."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
from makers.pages import CHECKOUT
from makers.runs import without_workers

FOLDER = CHECKOUT / "docs" / "notebooks"

SHOWN = {
    "near_miss_by_hand": "speed/limit  2.97, progress 1.000",
    "own_law": "limit-broken",
    "own_arm": "6 joints",
    "tuning": "of the trials that chose it",
    "comparing_libraries": "from daqp's answer",
    "reading_results": "lp-alpha is nearer",
}
"""A part of what each prints."""


def test_every_notebook_is_known() -> None:
    """And there is no other."""
    assert {each.stem for each in FOLDER.glob("*.py")} == set(SHOWN)


@pytest.mark.parametrize("name", SHOWN)
def test_a_notebook_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a folder of its own, beside the committed results."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").symlink_to(CHECKOUT / "results")
    with without_workers():
        runpy.run_path(str(FOLDER / f"{name}.py"))
    assert SHOWN[name] in capsys.readouterr().out
