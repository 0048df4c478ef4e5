"""The run of a study: trials in parallel, then times on one core; rows are committed at once."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from dikbench.errors import DikbenchError, unknown
from dikbench.metrics import take_errors
from dikbench.results.columns import TRIAL
from dikbench.results.folder import ResultsFolder
from dikbench.results.peers import write_peers
from dikbench.results.shards import SHARD, TRIALS_OF_SHARD, trials_to_run
from dikbench.results.store import Store
from dikbench.run.blocks import engine_of
from dikbench.run.folder_of_instances import instances_in
from dikbench.run.folder_of_study import store_for
from dikbench.run.in_workers import RunSettings, run_trials
from dikbench.run.other_metrics import clear_outdated, tell
from dikbench.run.peers import compare_with_peers, pairs_of, with_ticks
from dikbench.run.pool import THREAD_VARIABLES, workers
from dikbench.run.progress_display import ProgressDisplay
from dikbench.run.provenance import environment, git_commit, manifest
from dikbench.run.shards import WHOLE, trials_of_shard
from dikbench.run.timing import time_scenario, to_time
from dikbench.run.trial_row import TrialRow
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import parse_selector
from dikbench.simulation.status import Status
from dikbench.study.identity import sources_of, timing_id, trial_id_today
from dikbench.study.plan import PlannedTrial, expand
from dikbench.study.study import Study
from dikbench.study.trial import Trial

TIMING_TIMEOUT_S: Final = 900.0
"""Wall-clock limit of the timing of one scenario."""

OF_THE_TRIALS: Final = ("engine", "sources", SHARD, TRIALS_OF_SHARD)
"""Entries of the description of a run that stay when times alone are taken."""

MISSING: Final = "missing"
"""What the status of a trial without a row is called."""

OF_OTHER_SHARDS: Final = "missing, of other shards"
"""... and one of a shard that the folder has not run."""

OUTDATED: Final = "outdated"
RERUNS: Final = ("failed", OUTDATED, "all")
"""What may be run again, in addition to a formulation, scenario or solver."""


class Interrupted(Exception):
    """The user stopped the run; the message tells what is kept."""


def run_study(study: Study, out: Path, settings: RunSettings, command: str) -> ResultsFolder:
    """Run what is missing of a study in a results folder: trials, then times.

    A shard takes no times, since those that are compared are of one machine: they are taken when
    the study is run in the merged folder.

    Args:
        study: what to run.
        out: results folder; its finished trials are kept.
        settings: how to run it.
        command: the command line, for the manifest.

    Raises:
        DikbenchError: if the study or the folder is not valid, before anything runs; if the store
            fails, with committed rows kept.
        Interrupted: if the user stops the run; what is finished is kept.
    """
    folder = ResultsFolder(out)
    planned = expand(study, partial(instances_in, folder))
    _check_rerun(settings.rerun, planned)
    settings = replace(settings, metrics=study.metrics)
    with store_for(folder, study) as store:
        commit = git_commit()
        own = environment(commit, command)
        # What a worker of this run would say of itself, for rows of workers that died.
        worker = own | {"threads": dict.fromkeys(THREAD_VARIABLES, "1")}
        clear_outdated(store, study.metrics, out)
        hidden = store.hidden()
        engine = engine_of(planned, settings.engine, store)
        described = {**manifest(study, len(planned), own), "engine": engine}
        described["sources"] = sources_of(p.trial for p in planned)
        chosen = trials_of_shard(planned, settings.shard, engine)
        if settings.shard != WHOLE:
            described |= {SHARD: str(settings.shard), TRIALS_OF_SHARD: len(chosen)}
        run = store.begin_run(described, planned)
        if hides := store.hidden() - hidden:
            print(
                f"kept and not shown, of other sources than today: {hides} of the rows",
                file=sys.stderr,
            )
        done, positions = store.statuses(), {p.id: number for number, p in enumerate(planned)}
        outdated = store.outdated(own) if settings.rerun == OUTDATED else set()
        todo = [
            p
            for p in chosen
            if p.id not in done or p.id in outdated or _again(p, done[p.id], settings.rerun)
        ]
        if len(todo) < len(chosen):
            print(f"{len(chosen) - len(todo)} of {len(chosen)} trials are done", file=sys.stderr)
        errors: dict[str, str] = {}
        try:
            with ProgressDisplay(len(todo), "trials") as display:
                for rows in run_trials(todo, folder, settings, commit, command, engine):
                    for _, row in rows:
                        take_errors(row, errors)
                        row["environment"] = store.environment(row.pop("described", worker))
                    store.record_trials(
                        [({"id": trial.id, **row}, positions[trial.id]) for trial, row in rows], run
                    )
                    display.advance(len(rows))
            tell(errors)
            if study.timing is not None and settings.shard == WHOLE:
                known = set() if settings.rerun == "all" else store.timed() - outdated
                _time(folder, store, run, study, planned, known, worker)
        except KeyboardInterrupt:
            finished = len(store.statuses().keys() & {p.id for p in chosen})
            folder.export(store)
            raise Interrupted(f"{finished} of {len(chosen)} trials are done and kept") from None
        folder.export(store)
        store.close_neatly()
    return folder


def time_study(study: Study, out: Path, command: str) -> ResultsFolder:
    """Repeat the timing pass of a study, and nothing else.

    Args:
        study: the study whose cells are timed.
        out: results folder; its trials are kept.
        command: the command line, for the manifest.

    Raises:
        DikbenchError: if the study or the folder is not valid.
        Interrupted: if the user stops the run.
    """
    if study.timing is None:
        raise DikbenchError(f"study {study.name} has no section [timing]: add one to take times")
    planned = expand(study)
    folder = ResultsFolder(out)
    with store_for(folder, study) as store:
        described = environment(git_commit(), command)
        kept = {key: value for key, value in _last_run(store).items() if key in OF_THE_TRIALS}
        run = store.begin_run({**manifest(study, len(planned), described), **kept}, planned)
        try:
            _time(folder, store, run, study, planned, set(), described)
        except KeyboardInterrupt:
            raise Interrupted(f"{len(store.timed())} cells are timed and kept") from None
        folder.export(store)
        store.close_neatly()
    return folder


def _last_run(store: Store) -> Mapping[str, Any]:
    """Return the description of the last run; empty where there was none."""
    try:
        return store.runs()[-1]
    except DikbenchError:
        return {}


def _check_rerun(rerun: str, planned: Sequence[PlannedTrial]) -> None:
    names = {text for p in planned for text in _names(p.trial)}
    if rerun not in {"", *RERUNS, *names}:
        where = f"({', '.join(RERUNS)}, or a formulation, scenario or solver of the study)"
        raise unknown("what to rerun", rerun, [*RERUNS, *names], where)


def _names(trial: Trial) -> set[str]:
    """Return the texts that name a trial: its selectors, and their names alone."""
    selectors = (trial.formulation, trial.scenario, trial.solver)
    return {*map(str, selectors), *(selector.name for selector in selectors)}


def _again(planned: PlannedTrial, status: str, rerun: str) -> bool:
    """Say whether a finished trial is to be run again."""
    if rerun == "failed":
        return status not in {Status.OK.value, Status.SKIPPED.value}
    return rerun == "all" or rerun in _names(planned.trial)


def _time(
    folder: ResultsFolder,
    store: Store,
    run: int,
    study: Study,
    planned: Sequence[PlannedTrial],
    known: set[str],
    described: TrialRow,
) -> None:
    """Run the timing pass in one process of its own while no trial runs, and ask peers there.

    Args:
        folder: where comparisons with peers are kept.
        store: where times are committed.
        run: number of the run.
        study: whose cells are timed.
        planned: its trials.
        known: ids of cells whose times are kept.
        described: the environment.
    """
    timing, seed = study.timing, study.seeds[0]
    wanted = {
        scenario: cells
        for scenario, cells in to_time(study, planned, store.statuses()).items()
        if any(timing_id(*cell, scenario) not in known for cell in cells)
    }
    if not wanted or timing is None:
        return
    how = (timing.reference, timing.problems, timing.rounds)
    made = store.environment(described)
    with (
        workers(1, (time_scenario.__module__,)) as pool,
        ProgressDisplay(len(wanted), "timed scenarios") as display,
    ):
        futures = {
            scenario: pool.schedule(
                time_scenario, args=(scenario, seed, cells, *how), timeout=TIMING_TIMEOUT_S
            )
            for scenario, cells in wanted.items()
        }
        compared = {
            scenario: pool.schedule(
                compare_with_peers, args=(scenario, seed, pairs), timeout=TIMING_TIMEOUT_S
            )
            for scenario, cells in wanted.items()
            if (pairs := pairs_of(cells))
        }
        for scenario, future in futures.items():
            rows: list[TrialRow] = []
            try:
                rows = future.result()
            except Exception as error:  # a formulation may end the process: no times
                reason = f"{type(error).__name__}: {error}".partition("\n")[0]
                print(f"no times for {scenario}: {reason}", file=sys.stderr)
            for cell, row in zip(wanted[scenario], rows, strict=False):
                named = {"id": timing_id(*cell, scenario), "environment": made}
                store.record_times({**row, **named}, run)
            if scenario in compared:
                try:
                    write_peers(folder.path, with_ticks(compared[scenario].result(), rows))
                except Exception as error:  # as above
                    reason = f"{type(error).__name__}: {error}".partition("\n")[0]
                    print(f"no comparison with peers for {scenario}: {reason}", file=sys.stderr)
            display.advance()


def never_moved(out: Path) -> dict[str, str]:
    """Find the formulations of the last study of which no trial took a step.

    Oracles are among them only where nothing else moved.

    Returns:
        How often each reason was met, failures first, by the name of the formulation.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    with ResultsFolder(out).open_store() as store:
        trials = store.planned()
    still = trials[~trials.groupby("formulation")["steps"].transform("max").gt(0)]
    reasons = still["status"] + ": " + still["message"]
    found: dict[str, str] = {}
    for name, each in reasons.groupby(still["formulation"], sort=False):
        counts = each.value_counts(sort=False).sort_index(
            key=lambda texts: texts.str.startswith(Status.SKIPPED.value), kind="stable"
        )
        found[str(name)] = "; ".join(f"{number} {reason}" for reason, number in counts.items())
    of_formulations = {
        name: reason for name, reason in found.items() if parse_selector(name).name not in ORACLES
    }
    moved = trials["steps"].gt(0).any()
    return of_formulations if of_formulations or moved else found


def status_of(out: Path) -> dict[str, int]:
    """Count the trials of the last study by status, and those that are missing.

    A trial whose formulation or scenario family has changed since is missing. Nothing is drawn or
    built for it, and nothing written.

    Raises:
        DikbenchError: if the folder holds no results.
    """
    with ResultsFolder(out).open_store() as store:
        planned, runs = store.planned(), store.runs()
    cells = planned[TRIAL].itertuples(index=False, name=None)
    counts: Counter[str] = Counter()
    for name, status, cell in zip(planned["id"], planned["status"], cells, strict=True):
        today = trial_id_today(dict(zip(TRIAL, cell, strict=True)))
        counts[status if today in {None, name} else MISSING] += 1
    number = trials_to_run(runs)
    counts[MISSING] += number - len(planned)
    counts[OF_OTHER_SHARDS] = int(runs[-1]["trials"]) - number
    return dict(+counts)
