"""Running a study from Python, like `dikbench run`."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral
from pathlib import Path
from typing import Any, Literal, get_args

from msgspec.structs import asdict

from dikbench.errors import DikbenchError, unknown
from dikbench.parameters import Range
from dikbench.report.write import write_report
from dikbench.results.reading import Results, load_results
from dikbench.run import runner
from dikbench.run.blocks import EngineChoice
from dikbench.run.dask_client import scheduler_given
from dikbench.run.in_workers import RunSettings
from dikbench.run.pool import available_cores
from dikbench.run.shards import WHOLE, parse_shard
from dikbench.run.trial_row import TracePolicy
from dikbench.scenario.plant import REFERENCE_MODES
from dikbench.study.selection import Selection, select
from dikbench.study.study import DEFAULT_STUDY, Study, folder_of, load_study

Selectors = str | Iterable[str]

_LEAST_ONE = Range(1)

NONE = Selection()
"""Replaces nothing."""


def run_study(
    study: str | Path | None = None,
    *,
    formulations: Selectors = (),
    scenarios: Selectors = (),
    solvers: Selectors = (),
    seeds: int | Iterable[int] = (),
    plants: Selectors = (),
    references: Selectors = (),
    metrics: Selectors = (),
    instances: int = 0,
    fraction: float = 1.0,
    out: str | Path | None = None,
    jobs: int | None = None,
    trial_timeout: float = 120.0,
    trial_memory: int = 4096,
    traces: TracePolicy = "all",
    rerun: str = "",
    engine: EngineChoice = "auto",
    executor: Literal["local", "dask"] = "local",
    scheduler: str = "",
    shard: str = "1/1",
    report: bool = True,
) -> Results:
    """Run what is missing of a study, write its report and load its results.

        results = dikbench.run_study(
            formulations=["dls[damping=0.01|0.1]", "my_law.py:MyLaw"],
            scenarios="near-miss[robot=ur5,miss=0.02]",
            out="runs/mine",
        )

    It has the defaults of `dikbench run`; called again, it continues a run that was stopped. Your
    own formulations and families are given as `path/to/file.py:Class`, since every trial runs in
    its own process.

    Args:
        study: a shipped study (see `dikbench list studies`) or a TOML file; default: quick.
        formulations: selectors that replace those of the study; none, here and below: the study's
            own.
        scenarios: the same.
        solvers: the same.
        seeds: seeds of the scenarios that replace those of the study.
        plants: selectors that replace those of the study.
        metrics: metrics of yours, as `path/to/file.py:NAME`, beside those of dikbench.
        references: `time` or `path`: what advances the reference.
        instances: number of random instances of each scenario that are drawn, in place of seeds; 0:
            the study's own.
        fraction: the share of the instances that is run, the first ones.
        out: results folder; default: runs/STUDY, and one of its own for each selection without a
            study.
        jobs: number of worker processes; default: one per core.
        trial_timeout: wall-clock limit of a trial [s].
        trial_memory: memory of a trial [MB].
        traces: which trials keep their control steps: all, failures or none.
        rerun: finished trials that are run again: failed, outdated (made by other sources or
            versions), all, or the name or selector of a formulation, scenario or solver.
        engine: `lockstep`: trials of one kind run many at a time; `alone`: each by itself; `auto`:
            in lockstep where there are many of a kind. The results are the same but for rounding.
        executor: `dask`: trials run on the workers of a cluster; `local`: on this machine.
        scheduler: address of the scheduler of the cluster, or its file.
        shard: one of so many equal parts of the study, such as `2/4`, which `dikbench merge` puts
            together; the results are then what the folder has of the study.
        report: whether tables, figures and the report are written; never of a shard.

    Raises:
        DikbenchError: if the study, a selector or the folder is not valid.
        Interrupted: if the user stops the run; what is finished is kept.
    """
    if jobs is not None:
        _LEAST_ONE.check("jobs", jobs)
    _LEAST_ONE.check("trial_memory", trial_memory)
    Range(above=0.0, unit="s").check("trial_timeout", trial_timeout)
    Range(0).check("instances", instances)
    Range(above=0.0, high=1.0).check("fraction", fraction)
    _check_choice("traces", traces, get_args(TracePolicy))
    _check_choice("engine", engine, get_args(EngineChoice))
    _check_choice("executor", executor, ("local", "dask"))
    part, scheduler = parse_shard(shard), scheduler_given(executor, scheduler)
    selection = Selection(
        formulations=_texts("formulations", formulations),
        scenarios=_texts("scenarios", scenarios),
        solvers=_texts("solvers", solvers),
        seeds=_seeds(seeds),
        plants=_texts("plants", plants),
        references=_texts("references", references),
        metrics=_texts("metrics", metrics),
        instances=instances,
        fraction=fraction,
    )
    for reference in selection.references:
        _check_choice("references", reference, REFERENCE_MODES)
    chosen = selected(None if study is None else str(study), selection)
    settings = RunSettings(
        jobs or available_cores(),
        trial_timeout,
        trial_memory,
        traces,
        rerun,
        engine,
        shard=part,
        scheduler=scheduler,
    )
    folder = results_folder(chosen, out)
    given = {
        axis: found for axis, found in asdict(selection).items() if found != getattr(NONE, axis)
    }
    runner.run_study(chosen, folder, settings, f"dikbench.run_study({study!r}, **{given})")
    if report and part == WHOLE:
        write_report(folder)
    return load_results(folder)


def selected(study: str | None, selection: Selection) -> Study:
    """Return the study that a name or file and what replaces its axes select."""
    return select(load_study(study or DEFAULT_STUDY), selection, named=study is not None)


def results_folder(study: Study, out: str | Path | None) -> Path:
    """Return where a study's results go: the folder that was named, else one in runs."""
    return Path(out) if out is not None else Path("runs") / folder_of(study)


def _texts(axis: str, given: Selectors) -> tuple[str, ...]:
    texts = (given,) if isinstance(given, str) else tuple(given)
    for text in texts:
        if not isinstance(text, str):
            raise DikbenchError(
                f"{axis}: expected selectors as text, such as 'dls[damping=0.1]' or "
                f"'path/to/file.py:Class', got {text!r}"
            )
    return texts


def _seeds(given: Any) -> tuple[int, ...]:
    seeds = (given,) if isinstance(given, Integral) else tuple(given)
    for seed in seeds:
        if not isinstance(seed, Integral) or isinstance(seed, bool) or seed < 0:
            raise DikbenchError(f"seeds: expected integers of at least 0, got {seed!r}")
    return tuple(map(int, seeds))


def _check_choice(name: str, given: object, valid: Iterable[str]) -> None:
    if given not in tuple(valid):
        raise unknown(name, given, valid)
