"""A disk that is full at some moment of a run or a merge: one line, and nothing is lost by it.

No file may grow beyond a size: what Linux says where a disk is full is another word for that error.
"""

from __future__ import annotations

import resource
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
from makers.runs import run_here
from makers.short_study import STUDY, script_of, table

from dikbench.run.in_workers import RunSettings
from dikbench.run.merge import merge_results
from dikbench.run.shards import Shard

pytestmark = pytest.mark.long

MERGE = (sys.executable, "-B", "-c", "from dikbench.cli import main; main()", "merge", "1", "2")


def _on_a_full_disk(
    size: int, command: Sequence[str], cwd: Path
) -> subprocess.CompletedProcess[str]:
    """Run a command whose files may not be larger [bytes]."""
    limits = (size, resource.RLIM_INFINITY)
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=300,
        check=False,
        preexec_fn=partial(resource.setrlimit, resource.RLIMIT_FSIZE, limits),
    )


def _assert_same(one: Path, other: Path) -> None:
    pd.testing.assert_frame_equal(table(one), table(other), check_exact=True)


@pytest.mark.parametrize("size", [0, 20_000, 60_000, 200_000])
def test_a_run_on_a_full_disk_goes_on_where_there_is_room(tmp_path: Path, size: int) -> None:
    """Nothing fits, no trace, not the store, or not the exports."""
    done = _on_a_full_disk(size, script_of(STUDY, tmp_path, 1), tmp_path)
    if done.returncode:
        assert done.stderr.splitlines()[-1].startswith("dikbench."), done.stderr
        assert "Error: " in done.stderr.splitlines()[-1]
    for name in ("out", "alone"):
        run_here(STUDY, tmp_path / name, RunSettings(1), "there is room")
    _assert_same(tmp_path / "out", tmp_path / "alone")


@pytest.fixture
def _shards(tmp_path: Path) -> None:
    for number in (1, 2):
        run_here(STUDY, tmp_path / str(number), RunSettings(1, shard=Shard(number, 2)), "a shard")
    merge_results([tmp_path / "1", tmp_path / "2"], tmp_path / "alone", "a merge")


@pytest.mark.usefixtures("_shards")
@pytest.mark.parametrize("there", [False, True])
def test_a_merge_on_a_full_disk_is_as_if_it_had_not_been(tmp_path: Path, there: bool) -> None:
    """What was merged before stays, byte for byte; where there is room, all is merged."""
    out = tmp_path / "out"
    if there:
        shutil.copytree(tmp_path / "alone", out)
    before = {path: path.read_bytes() for path in out.rglob("*.sqlite")}
    for size in (0, 30_000):
        done = _on_a_full_disk(size, [*MERGE, "--out", "out"], tmp_path)
        assert done.returncode == 2, done.stderr
        [said] = [line for line in done.stderr.splitlines() if not line.startswith("merged ")]
        assert said.startswith("error: ")
        assert before == {path: path.read_bytes() for path in out.rglob("*.sqlite")}
        assert not list(out.glob("*partial*"))
    merge_results([tmp_path / "1", tmp_path / "2"], out, "a merge")
    _assert_same(out, tmp_path / "alone")


@pytest.mark.usefixtures("_shards")
def test_a_merge_that_is_killed_is_made_by_the_same_command(tmp_path: Path) -> None:
    """At any moment."""
    for tenths in range(10, 34, 4):
        process = subprocess.Popen([*MERGE, "--out", "out"], cwd=tmp_path)
        try:
            process.wait(tenths / 10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        merge_results([tmp_path / "1", tmp_path / "2"], tmp_path / "out", "a merge")
        _assert_same(tmp_path / "out", tmp_path / "alone")
        if tenths % 8:
            shutil.rmtree(tmp_path / "out")
