"""How a run ends that is interrupted or killed, or whose disk is full."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from makers.commands import SHORT, dikbench, hear_ctrl_c

TIRES = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Tires:
    def velocity(self, problem, solve):
        with open("steps", "a") as file:
            file.write(".")
            loops = file.tell() > 5 * 20
        while loops:
            pass
        return problem.primary.J.T @ problem.primary.V
"""
"""Loops for ever after five trials of twenty steps."""


def test_ctrl_c_keeps_what_is_finished_and_says_how_to_go_on(tmp_path: Path) -> None:
    """Exit code 130, the rows so far, and the command; nobody goes on with what loops for ever."""
    (tmp_path / "tires.py").write_text(TIRES)
    arguments = ["run", "--formulation", "tires.py:Tires", *SHORT[2:], "--out", "out"]
    arguments += ["--jobs", "1"]
    for seed in range(8):
        arguments += ["--seed", str(seed)]
    process = subprocess.Popen(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        cwd=tmp_path,
        preexec_fn=hear_ctrl_c,
    )
    store = tmp_path / "out" / "results.sqlite"
    for _ in range(600):
        time.sleep(0.1)
        if store.exists():
            try:
                with sqlite3.connect(store) as database:
                    if database.execute("SELECT COUNT(*) FROM trials").fetchone()[0] >= 5:
                        break
            except sqlite3.OperationalError:
                continue  # its tables are not there yet
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "5 of 8 trials are done and kept; to continue: dikbench run" in said
    assert "Traceback" not in said
    assert len(pd.read_csv(tmp_path / "out" / "trials.csv")) == 5
    _assert_nobody_is_left_in(tmp_path)


@pytest.mark.skipif(not Path("/dev/shm").is_dir() or os.geteuid() != 0, reason="needs a tmpfs")
def test_a_full_disk_is_one_line_and_what_was_committed_is_kept(tmp_path: Path) -> None:
    """On a file system of one megabyte."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting is not allowed here")
    try:
        arguments = [
            "run",
            *SHORT,
            "--scenario",
            "reach",
            "--out",
            str(disk / "out"),
            "--jobs",
            "1",
        ]
        for seed in range(30):
            arguments += ["--seed", str(seed)]
        done = dikbench(*arguments, cwd=tmp_path)
        assert done.returncode == 2, done.stderr
        last = done.stderr.splitlines()[-1]
        assert last.startswith("error: ")
        assert "space" in last or "full" in last
        assert "Traceback" not in done.stderr
        shutil.copytree(disk / "out", tmp_path / "copy")
        with sqlite3.connect(tmp_path / "copy" / "results.sqlite") as database:
            assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
            assert database.execute("SELECT COUNT(*) FROM trials").fetchone()[0] > 0
    finally:
        subprocess.run(["umount", str(disk)], check=True)


SPINNING = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Spin:
    def velocity(self, problem, solve):
        open("spinning", "w").close()
        while True:
            pass
"""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such signal")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_no_worker_outlives_its_driver(tmp_path: Path, how: signal.Signals) -> None:
    """However the driver ends, a formulation that loops for ever ends with it; ctrl-c as well."""
    (tmp_path / "spin.py").write_text(SPINNING)
    arguments = ["run", "--formulation", "spin.py:Spin", *SHORT[2:], "--out", "out", "--jobs", "1"]
    process = subprocess.Popen(
        [sys.executable, "-c", "from dikbench.cli import main; main()", *arguments],
        stderr=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        cwd=tmp_path,
    )
    for _ in range(1200):
        if (tmp_path / "spinning").exists() or process.poll() is not None:
            break
        time.sleep(0.1)
    at_work = _processes_in(tmp_path)
    process.send_signal(how)
    process.wait(timeout=60)
    assert len(at_work) >= 2
    _assert_nobody_is_left_in(tmp_path)


def _assert_nobody_is_left_in(folder: Path) -> None:
    """Wait a while for the processes whose working folder this is."""
    for _ in range(300):
        if not _processes_in(folder):
            break
        time.sleep(0.1)
    assert not _processes_in(folder)


def _processes_in(folder: Path) -> list[str]:
    """The processes whose working folder this is."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if os.readlink(process / "cwd") == str(folder):
                found.append(process.name)
        except OSError:  # gone, or not ours
            continue
    return found
