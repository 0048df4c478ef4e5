"""The run of a study: trials in parallel, then times on one core, then the files."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import Future, as_completed
from pathlib import Path
from typing import Any

from pebble import ProcessExpired

from dikbench.run.manifest import manifest
from dikbench.run.progress_display import ProgressDisplay
from dikbench.run.results import ResultsFolder
from dikbench.run.timing import Cell, time_scenario
from dikbench.run.worker import Row, row_without_run, run_trial
from dikbench.run.workers import workers
from dikbench.status import Status
from dikbench.study import PlannedTrial, Study, expand

TRIAL_TIMEOUT = 120.0
"""Wall-clock limit of a trial [s], enforced from outside its process."""

TIMING_TIMEOUT = 1800.0
"""Wall-clock limit of the timing of one scenario [s]."""


def run_study(study: Study, out: Path, jobs: int, command: str) -> ResultsFolder:
    """Run a study and write trials.csv, manifest.json and the traces.

    Args:
        study: what to run.
        out: results folder.
        jobs: number of worker processes.
        command: the command line, for the manifest.

    Raises:
        DikbenchError: before anything runs, if the study or the folder is not valid.
    """
    planned = expand(study)
    folder = ResultsFolder(out)
    folder.prepare()
    description = manifest(study, len(planned), command)
    rows = run_trials(planned, folder.traces, jobs)
    times = time_cells(study, planned) if study.timing is not None else []
    folder.write(rows, times, description)
    folder.forget_traces_but({p.trial.id for p in planned})
    return folder


def run_trials(planned: Sequence[PlannedTrial], traces: Path, jobs: int) -> list[Row]:
    """Run every trial in worker processes; the rows are in the order of the plan."""
    rows: dict[int, Row] = {}
    with workers(jobs) as pool, ProgressDisplay(len(planned), "trials") as display:
        futures: dict[Future[Row], int] = {}
        for index, (trial, skip) in enumerate((p.trial, p.skip) for p in planned):
            if skip:
                rows[index] = row_without_run(trial, Status.SKIPPED, skip)
                display.advance()
            else:
                future = pool.schedule(run_trial, args=(trial, traces), timeout=TRIAL_TIMEOUT)
                futures[future] = index
        for future in as_completed(futures):
            index = futures[future]
            rows[index] = _row(future, planned[index])
            display.advance()
    return [rows[index] for index in range(len(planned))]


def _row(future: Future[Row], planned: PlannedTrial) -> Row:
    """The row of a finished trial, whatever became of it."""
    try:
        return future.result()
    except TimeoutError:
        reason = f"not finished after {TRIAL_TIMEOUT:g} s"
        return row_without_run(planned.trial, Status.TIMEOUT, reason)
    except ProcessExpired as error:
        reason = f"the worker ended with exit code {error.exitcode}"
        return row_without_run(planned.trial, Status.CRASHED, reason)
    except MemoryError:
        return row_without_run(planned.trial, Status.OUT_OF_MEMORY, "out of memory")
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".partition("\n")[0]
        return row_without_run(planned.trial, Status.FORMULATION_ERROR, reason)


def time_cells(study: Study, planned: Sequence[PlannedTrial]) -> list[Row]:
    """The timing pass, in one process of its own after all trials have ended."""
    timing = study.timing
    assert timing is not None
    cells: list[Cell] = list(
        dict.fromkeys((p.trial.formulation, p.trial.solver) for p in planned if not p.skip)
    )
    scenarios = [s for s in study.scenarios if not timing.scenarios or s in timing.scenarios]
    rows: list[Row] = []
    if not cells:
        return rows
    with workers(1) as pool, ProgressDisplay(len(scenarios), "timed scenarios") as display:
        arguments: tuple[Any, ...] = (cells, timing.reference, timing.problems, timing.rounds)
        futures = [
            pool.schedule(
                time_scenario,
                args=(scenario, study.seeds[0], *arguments),
                timeout=TIMING_TIMEOUT,
            )
            for scenario in scenarios
        ]
        for scenario, future in zip(scenarios, futures, strict=True):
            try:
                rows.extend(future.result())
            except Exception as error:  # a law can take the process with it: no times, no harm
                reason = f"{type(error).__name__}: {error}".partition("\n")[0]
                print(f"no times for {scenario}: {reason}", file=sys.stderr)
            display.advance()
    return rows
