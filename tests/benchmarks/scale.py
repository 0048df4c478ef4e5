"""What 10^5, 10^6 and 10^7 trials cost: core hours, bytes, and the time of the one writer.

    python tests/benchmarks/scale.py

Each figure is measured on a sample and multiplied. Times are of the processor, not of the clock, so
that what else runs on the machine matters little.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import pickle
import resource
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time

from dikbench.results.folder import ResultsFolder
from dikbench.results.store import Store
from dikbench.run.blocks import blocks_of
from dikbench.run.in_workers import RunSettings
from dikbench.run.provenance import environment, manifest
from dikbench.run.runner import run_study
from dikbench.run.trial_row import TrialRow, work
from dikbench.run.trials_together import work_together
from dikbench.study.plan import PlannedTrial, expand
from dikbench.study.study import Cells, Study

SAMPLE = Study(
    description="drawn instances of two families and robots, laws with and without a solver",
    cells=(Cells(("dls", "dls-manipulability", "qp", "lp-alpha")),),
    scenarios=("reach[robot=panda]", "near-miss[robot=ur5]"),
    plants=("ideal",),
    instances=96,
    name="sample",
)

SIZES = (10**5, 10**6, 10**7)

WRITTEN = 20_000
"""So many rows are written to measure what the writer does."""

IN_A_BLOCK = 1024
ALONE = 96
"""So many trials are run alone, spread over the sample."""

SHORT = 200, 2200
"""So many short trials are run to measure what the driver does for each: what the second run takes
more than the first."""


@dataclass
class Costs:
    """What one trial costs: seconds of a processor, and bytes."""

    alone_s: float = 0.0
    lockstep_s: float = 0.0
    written_singly_s: float = 0.0
    written_in_blocks_s: float = 0.0
    handled_here_s: float = 0.0
    handled_on_dask_s: float = 0.0
    planned_s: float = 0.0
    exported_s: float = 0.0
    stored_bytes: float = 0.0
    exported_bytes: float = 0.0
    trace_bytes: float = 0.0
    row_bytes: float = 0.0
    planned_bytes: float = 0.0


def measured() -> Costs:
    """Measure everything."""
    costs = Costs()
    planned = expand(SAMPLE)
    with tempfile.TemporaryDirectory() as folder:
        row = _run(planned, ResultsFolder(Path(folder)), costs)
        _write(planned[0], row, Path(folder), costs)
    _handle(costs)
    _plan(costs)
    for name in ("handled_here_s", "handled_on_dask_s"):  # what is told apart
        setattr(costs, name, getattr(costs, name) - costs.planned_s - costs.exported_s)
    return costs


def _run(planned: Sequence[PlannedTrial], folder: ResultsFolder, costs: Costs) -> TrialRow:
    """Run a sample alone, and all of it in lockstep; return a row."""
    folder.traces.mkdir()
    chosen = planned[:: len(planned) // ALONE]
    work(chosen[0].trial, folder.trace("first"), "none", None, "")  # what is loaded once is loaded
    with _timed(len(chosen)) as took:
        for p in chosen:
            row, _ = work(p.trial, folder.trace(p.id), "all", None, "")
    costs.alone_s = took[0]
    sizes = [file.stat().st_size for file in folder.traces.iterdir()]
    costs.trace_bytes = sum(sizes) / len(sizes)
    costs.row_bytes = len(pickle.dumps(row))
    with _timed(len(planned)) as took:
        for block in blocks_of(planned, 1):
            traces = [folder.trace(p.id) for p in block]
            work_together([p.trial for p in block], traces, "none", None, "")
    costs.lockstep_s = took[0]
    return row


def _write(p: PlannedTrial, row: TrialRow, folder: Path, costs: Costs) -> None:
    """Write rows as a run does: one by one, in blocks, and into the exports."""
    described = environment(None, "scale")
    rows = [{**row, "id": f"{number:016x}", "seed": number} for number in range(WRITTEN)]
    for name, size in (("singly", 1), ("in_blocks", IN_A_BLOCK)):
        out = ResultsFolder(folder / name)
        out.traces.mkdir(parents=True)
        with Store(out.database) as store:
            run = store.begin_run(manifest(SAMPLE, WRITTEN, described), [])
            with _timed(WRITTEN) as took:
                for first in range(0, WRITTEN, size):
                    given = []
                    for number, each in enumerate(rows[first : first + size], start=first):
                        each["environment"] = store.environment(described)
                        given.append((each, number))
                    store.record_trials(given, run)
            setattr(costs, f"written_{name}_s", took[0])
            store.close_neatly()
            costs.stored_bytes = out.database.stat().st_size / WRITTEN
            with _timed(WRITTEN) as took:
                out.export(store)
            costs.exported_s = took[0]
        exported = sum(file.stat().st_size for file in out.path.glob("trials.*"))
        costs.exported_bytes = exported / WRITTEN


def _short(number: int) -> Study:
    """Make a study of so many short trials."""
    laws = tuple(f"dls[damping={1e-6 * (each + 1):.6f}]" for each in range(number))
    scenario = "reach[duration=0.1]"
    return Study("short trials", (Cells(laws),), (scenario,), plants=("ideal",), name="short")


def _handle(costs: Costs) -> None:
    """Run short trials, each alone; what is told is of the driver, not of the workers.

    The scheduler of the cluster is in the driver's process, so that its work is in the figure too.
    """
    from distributed import LocalCluster

    few, many = SHORT
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with tempfile.TemporaryDirectory() as folder, LocalCluster(**how) as cluster:
        for name, scheduler in (("here", ""), ("on_dask", cluster.scheduler_address)):
            settings = RunSettings(2, traces="none", engine="alone", scheduler=scheduler)
            spent = []
            for number in SHORT:
                with _timed(1) as took:
                    run_study(_short(number), Path(folder) / f"{name}{number}", settings, "scale")
                spent += took
            setattr(costs, f"handled_{name}_s", (spent[1] - spent[0]) / (many - few))


def _plan(costs: Costs) -> None:
    """Make a plan of many trials."""
    study = _short(WRITTEN)
    before = _memory()
    with _timed(WRITTEN) as took:
        planned = expand(study)
    costs.planned_s = took[0]
    costs.planned_bytes = (_memory() - before) / len(planned)


def _memory() -> int:
    """Return the memory that this process has now [bytes]."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:  # not Linux: the largest that it has had
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return pages * resource.getpagesize()


@contextmanager
def _timed(pieces: int) -> Iterator[list[float]]:
    """Yield a list that gets the processor's time for each piece [s]."""
    took: list[float] = []
    begun = process_time()
    yield took
    took.append((process_time() - begun) / pieces)


def table(costs: Costs) -> str:
    """Write what studies cost, as a table in Markdown."""
    rows = {
        "core hours, each trial alone": [_number(costs.alone_s * n / 3600) for n in SIZES],
        "core hours, in lockstep": [_number(costs.lockstep_s * n / 3600) for n in SIZES],
        "store": [_bytes(costs.stored_bytes * n) for n in SIZES],
        "trials.csv and trials.parquet": [_bytes(costs.exported_bytes * n) for n in SIZES],
        "traces, where all are kept": [_bytes(costs.trace_bytes * n) for n in SIZES],
        "rows on the network": [_bytes(costs.row_bytes * n) for n in SIZES],
        "writer, row by row": [_time(costs.written_singly_s * n) for n in SIZES],
        "writer, in blocks": [_time(costs.written_in_blocks_s * n) for n in SIZES],
        "driver, each trial alone": [_time(costs.handled_here_s * n) for n in SIZES],
        "driver and scheduler of dask": [_time(costs.handled_on_dask_s * n) for n in SIZES],
        "plan": [_time(costs.planned_s * n) for n in SIZES],
        "plan in the driver's memory": [_bytes(costs.planned_bytes * n) for n in SIZES],
        "export": [_time(costs.exported_s * n) for n in SIZES],
    }
    lines = ["| trials | " + " | ".join(f"{n:.0e}".replace("e+0", "e") for n in SIZES) + " |"]
    lines.append("|---|" + "---:|" * len(SIZES))
    lines += [f"| {name} | {' | '.join(cells)} |" for name, cells in rows.items()]
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.2g}" if value < 10 else f"{value:,.0f}"


def _bytes(value: float) -> str:
    for unit in ("kB", "MB", "GB"):
        value /= 1e3
        if value < 1e3:
            return f"{value:.3g} {unit}"
    return f"{value / 1e3:.3g} TB"


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{_number(seconds)} s"
    return f"{_number(seconds / 60)} min" if seconds < 7200 else f"{_number(seconds / 3600)} h"


def main() -> None:
    """Print what a trial costs, what studies cost, and where the writer has no time left."""
    costs = measured()
    for name, value in vars(costs).items():
        unit = "ms" if name.endswith("_s") else "bytes"
        print(f"{name.rpartition('_')[0]:20} {value * (1e3 if unit == 'ms' else 1):10.3f} {unit}")
    print(f"\n{table(costs)}\n")
    for how, trial, driver in (
        ("alone, on this machine", costs.alone_s, costs.handled_here_s),
        ("alone, on dask", costs.alone_s, costs.handled_on_dask_s),
        ("alone, the writer itself", costs.alone_s, costs.written_singly_s),
        ("lockstep, the writer itself", costs.lockstep_s, costs.written_in_blocks_s),
    ):
        print(f"{how}: it keeps up with {trial / driver:,.0f} cores")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
