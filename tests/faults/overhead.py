"""What bookkeeping costs: thousands of short trials, wall time and the driver's memory.

python tests/faults/overhead.py --trials 10000

The memory is told as how much it is above that of the driver before it ran anything. With
--scheduler the trials run on a cluster of dask, of two threads in all.
"""

from __future__ import annotations

import argparse
import resource
import sqlite3
import tempfile
import time
from contextlib import closing
from pathlib import Path

from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.study.plan import expand
from dikbench.study.study import Cells, Study


def study_of(trials: int) -> Study:
    """Short trials (50 ticks), half `dls`, half `qp` with warm daqp, all of one scenario."""
    dampings = [f"{1e-5 * (number + 1):.5f}" for number in range(trials // 2)]
    return Study(
        description="short trials",
        cells=(
            Cells(tuple(f"dls[damping={damping}]" for damping in dampings)),
            Cells(
                tuple(f"qp[damping={damping}]" for damping in dampings),
                ("daqp[interface=warm]",),
            ),
        ),
        scenarios=("reach[duration=0.5]",),
        plants=("ideal",),
        name="short",
    )


def _largest_memory() -> float:
    """Return the largest memory that this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Run 1000 trials, then all, and print what each cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=10_000)
    parser.add_argument("--scheduler", default="", help="address of a scheduler, or its file")
    arguments = parser.parse_args()
    settings = RunSettings(jobs=2, traces="none", scheduler=arguments.scheduler)
    start = _largest_memory()
    for count in (1000, arguments.trials):
        begun = time.perf_counter()
        planned = expand(study_of(count))
        expanding = time.perf_counter() - begun
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            out = Path(folder) / "out"
            run_study(study_of(count), out, settings, "overhead")
            wall = time.perf_counter() - begun
            memory = _largest_memory() - start
            with closing(sqlite3.connect(out / "results.sqlite")) as database:
                [busy] = database.execute("SELECT SUM(wall_time_s) FROM trials").fetchone()
        print(
            f"{len(planned)} trials: expanded in {expanding:.2f} s, run in {wall:.1f} s, of it "
            f"{1e3 * busy / count:.2f} ms per trial in the trial; overhead "
            f"{1e3 * (2 * wall - busy) / count:.2f} ms of worker time per trial; the driver's "
            f"largest memory {memory:.0f} MB above its start",
            flush=True,
        )


if __name__ == "__main__":
    main()
