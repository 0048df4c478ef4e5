"""A disk that is full at some moment of a run or a merge: one line, and nothing is lost by it."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from makers.commands import SHORT, dikbench
from makers.short_study import table

CODE = """
import resource, sys
size = int(sys.argv.pop(1))
resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
from dikbench.cli import main
if __name__ == "__main__":
    main()
"""
"""The command line in which no file may grow beyond a size: what Linux says where a disk is full is
another word for the same error."""

SIZES = (0, 3_000, 30_000, 60_000, 100_000, 150_000, 300_000)
"""[bytes] From nothing, over a trace and the store, to some file of the report."""


def _on_a_full_disk(size: int, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    (cwd / "script.py").write_text(CODE)
    return subprocess.run(
        [sys.executable, "-B", "script.py", str(size), *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=300,
        check=False,
    )


def _assert_one_line(done: subprocess.CompletedProcess[str]) -> None:
    assert "Traceback" not in done.stderr, done.stderr
    said = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert (done.returncode, len(said)) in {(0, 0), (2, 1)}, done.stderr


@pytest.mark.long
@pytest.mark.parametrize("size", SIZES)
def test_a_run_on_a_full_disk_goes_on_where_there_is_room(tmp_path: Path, size: int) -> None:
    """The same command has the rows of a run that was left alone."""
    run = ("run", *SHORT, "--seed", "0", "--seed", "1", "--seed", "2")
    _assert_one_line(_on_a_full_disk(size, *run, "--out", "out", cwd=tmp_path))
    for out in ("out", "alone"):
        done = dikbench(*run, "--out", out, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    pd.testing.assert_frame_equal(
        table(tmp_path / "out"), table(tmp_path / "alone"), check_exact=True
    )


@pytest.mark.long
def test_a_merge_on_a_full_disk_is_as_if_it_had_not_been(tmp_path: Path) -> None:
    """What was merged before stays, byte for byte; where there is room, all is merged."""
    study = ("--seed", "0", "--seed", "1", "--seed", "2", "--traces", "none")
    for number in (1, 2):
        shard = ("--shard", f"{number}/2", "--out", str(number))
        assert dikbench("run", *SHORT, *study, *shard, cwd=tmp_path).returncode == 0
    for there in (False, True):
        out = tmp_path / f"out{there}"
        if there:
            assert dikbench("merge", "1", "2", "--out", out.name, cwd=tmp_path).returncode == 0
        before = {path: path.read_bytes() for path in out.rglob("*.sqlite")}
        done = _on_a_full_disk(30_000, "merge", "1", "2", "--out", out.name, cwd=tmp_path)
        assert done.returncode == 2
        _assert_one_line(done)
        assert before == {path: path.read_bytes() for path in out.rglob("*.sqlite")}
        assert not [path for path in out.iterdir() if "partial" in path.name]
        assert dikbench("merge", "1", "2", "--out", out.name, cwd=tmp_path).returncode == 0
        assert len(table(out)) == 3


@pytest.mark.long
def test_a_merge_that_is_killed_is_made_by_the_same_command(tmp_path: Path) -> None:
    """At any moment."""
    study = ("--seed", "0", "--seed", "1", "--seed", "2")
    for number in (1, 2):
        shard = ("--shard", f"{number}/2", "--out", str(number))
        assert dikbench("run", *SHORT, *study, *shard, cwd=tmp_path).returncode == 0
    assert dikbench("merge", "1", "2", "--out", "alone", cwd=tmp_path).returncode == 0
    for tenths in range(1, 30, 3):
        command = [sys.executable, "-c", "from dikbench.cli import main; main()"]
        process = subprocess.Popen([*command, "merge", "1", "2", "--out", "out"], cwd=tmp_path)
        try:
            process.wait(tenths / 10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        assert dikbench("merge", "1", "2", "--out", "out", cwd=tmp_path).returncode == 0
        found, expected = table(tmp_path / "out"), table(tmp_path / "alone")
        pd.testing.assert_frame_equal(found, expected, check_exact=True)
        if tenths % 2:
            shutil.rmtree(tmp_path / "out")
