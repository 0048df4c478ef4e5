"""Kill a run at random moments, continue it, and compare with one that was left alone.

    python tests/faults/kill.py --times 50

Driver and workers die by SIGKILL. The final store must equal that of an undisturbed run in every
column but the times and the worker's environment, no row lost, none twice.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pandas as pd

from dikbench.results.columns import TIMES
from dikbench.results.reading import load_results

ARGUMENTS = [
    "run", "--plant", "ideal", "--seed", "0", "--seed", "1", "--seed", "2",
    "--formulation", "dls", "--formulation", "qp", "--solver", "daqp[interface=warm]",
    "--scenario", "reach[duration=1]", "--scenario", "near-miss[miss=0.05]",
    "--scenario", "speed-sweep[laps=2]",
]  # fmt: skip
TIMELESS = ["wall_time_s", "control_time_s", "environment", "run", *TIMES]


def start(out: Path) -> subprocess.Popen[bytes]:
    """Start the run in a process group of its own."""
    code = f"import sys; sys.argv = ['dikbench', *{ARGUMENTS!r}, '--out', {str(out)!r}]\n"
    code += "from dikbench.cli import main\nif __name__ == '__main__':\n    main()\n"
    return subprocess.Popen(
        [sys.executable, "-c", code],
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def children(process: int) -> list[int]:
    """The processes that a process has started, and theirs."""
    found = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True, check=False
    )
    direct = [int(text) for text in found.stdout.split()]
    return [*direct, *(below for child in direct for below in children(child))]


def table(out: Path) -> pd.DataFrame:
    """Every column that must be equal."""
    return load_results(out).trials.drop(columns=TIMELESS)


def counted(out: Path) -> tuple[int, int]:
    """Number of rows, and of different trials, in a store that is as it should be."""
    with sqlite3.connect(out / "results.sqlite") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        if not database.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
            return 0, 0
        found: tuple[int, int] = database.execute(
            "SELECT COUNT(*), COUNT(DISTINCT id) FROM trials"
        ).fetchone()
    return found


def main() -> None:
    """Run, kill, compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=50, help="number of kills (default: 50)")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    choose = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory() as folder:
        alone = Path(folder) / "alone"
        begun = time.monotonic()
        start(alone).wait()
        length = time.monotonic() - begun
        expected = table(alone)
        killed = finished = 0
        out = Path(folder) / "killed"
        while killed < arguments.times:
            process = start(out)
            try:
                process.wait(timeout=choose.uniform(0.1, 1.0) * length)
            except subprocess.TimeoutExpired:
                victims = [process.pid, *children(process.pid)]
                choose.shuffle(victims)
                for victim in victims:
                    try:
                        os.kill(victim, signal.SIGKILL)
                    except ProcessLookupError:
                        pass
                process.wait()
                killed += 1
            if not (out / "results.sqlite").exists():
                continue
            rows = counted(out)
            assert rows[0] == rows[1] <= len(expected)
            print(f"{killed} kills, {rows[0]} of {len(expected)} rows", flush=True)
            if rows[0] == len(expected):
                start(out).wait()
                pd.testing.assert_frame_equal(table(out), expected, check_exact=True)
                finished += 1
                out = Path(folder) / f"killed{finished}"
        start(out).wait()
        pd.testing.assert_frame_equal(table(out), expected, check_exact=True)
    print(f"{killed} kills, {finished + 1} runs completed, every row as it should be")


if __name__ == "__main__":
    main()
