"""docs/guides/many-machines.md: its study, its commands and its script are run."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from makers.commands import in_process
from makers.runs import run_here, without_figures, without_workers
from makers.short_study import table

from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import status_of
from dikbench.study.study import load_study

GUIDE = Path(__file__).parents[3] / "docs" / "guides" / "many-machines.md"
BLOCKS = [
    block.partition("\n")[::2] for block in GUIDE.read_text(encoding="utf-8").split("```")[1::2]
]
[STUDY] = [text for language, text in BLOCKS if language == "toml"]
SHARDED, MERGED, ON_DASK = (text.splitlines() for language, text in BLOCKS if language == "sh")
[SCRIPT] = [text for language, text in BLOCKS if language == "python"]


@pytest.fixture
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("my_study.toml").write_text(STUDY, encoding="utf-8")
    Path("on_a_cluster.py").write_text(SCRIPT, encoding="utf-8")


def _assert_the_rows_of_one_process(folder: str) -> None:
    run_here(load_study("my_study.toml"), Path("one"), RunSettings(1), "one process")
    found, expected = (table(Path(name)) for name in (folder, "one"))
    pd.testing.assert_frame_equal(found, expected, check_exact=True)
    assert set(found["status"]) == {"ok"}


@pytest.mark.usefixtures("_folder")
def test_documented_shards_are_merged_to_the_rows_of_one_process() -> None:
    """Each command ends well; the last one finds nothing to run."""
    with without_workers(), without_figures():
        for command in (*SHARDED, *MERGED):
            name, *arguments = shlex.split(command)
            assert name == "dikbench"
            done = in_process(*arguments)
            assert done.exit_code == 0, done.output
    assert "24 of 24 trials are done" in done.output
    _assert_the_rows_of_one_process("runs/my_study")
    sizes = [len(table(Path(f"parts/{number}"))) for number in range(1, 5)]
    assert sizes == [6] * 4
    assert status_of(Path("parts/1")) == {"ok": 6, "missing, of other shards": 18}


@pytest.mark.long
@pytest.mark.usefixtures("_folder")
def test_documented_commands_run_on_a_cluster() -> None:
    """By a shell, which ends scheduler and workers after them."""
    pytest.importorskip("distributed")
    ended = ["code=$?", "trap 'exit $code' TERM", "kill 0"]
    path = f'export PATH="{Path(sys.executable).parent}:$PATH"'
    script = "\n".join([path, *ON_DASK, *ended, "wait"])
    done = subprocess.run(
        ["bash", "-c", script],
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
        start_new_session=True,
    )
    assert done.returncode == 0, done.stderr
    _assert_the_rows_of_one_process("runs/on_dask")


@pytest.mark.long
@pytest.mark.usefixtures("_folder")
def test_the_documented_script_runs_on_a_cluster() -> None:
    """As a user starts it."""
    pytest.importorskip("distributed")
    done = subprocess.run(
        [sys.executable, "on_a_cluster.py"],
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "ok    24" in done.stdout
    _assert_the_rows_of_one_process("runs/from_python")
