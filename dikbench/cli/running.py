"""Running a study from Python, like `dikbench run`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from msgspec.structs import asdict

from dikbench.report.write import write_report
from dikbench.results.reading import Results, load_results
from dikbench.run.pool import available_cores
from dikbench.run.runner import RunSettings
from dikbench.run.runner import run_study as run_selected
from dikbench.run.trial_row import TracePolicy
from dikbench.study.study import DEFAULT_STUDY, Selection, Study, load_study, select

Selectors = str | Iterable[str]


def run_study(
    study: str | Path | None = None,
    *,
    formulations: Selectors = (),
    scenarios: Selectors = (),
    solvers: Selectors = (),
    seeds: Iterable[int] = (),
    plants: Selectors = (),
    references: Selectors = (),
    out: str | Path | None = None,
    jobs: int | None = None,
    trial_timeout: float = 120.0,
    trial_memory: int = 4096,
    traces: TracePolicy = "all",
    rerun: str = "",
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
        formulations: selectors that replace those of the study.
        scenarios: the same.
        solvers: the same.
        seeds: seeds of the scenarios that replace those of the study.
        plants: selectors that replace those of the study.
        references: `time` or `path`: what advances the reference.
        out: results folder; default: runs/STUDY.
        jobs: number of worker processes; default: one per core.
        trial_timeout: wall-clock limit of a trial [s].
        trial_memory: memory of a trial [MB].
        traces: which trials keep their control steps: all, failures or none.
        rerun: finished trials that are run again: failed, all, or the name or selector of a
            formulation, scenario or solver.
        report: whether tables, figures and the report are written.

    Raises:
        DikbenchError: if the study, a selector or the folder is not valid.
        Interrupted: if the user stops the run; what is finished is kept.
    """
    selection = Selection(
        formulations=_texts(formulations),
        scenarios=_texts(scenarios),
        solvers=_texts(solvers),
        seeds=tuple(seeds),
        plants=_texts(plants),
        references=_texts(references),
    )
    chosen = selected(None if study is None else str(study), selection)
    settings = RunSettings(jobs or available_cores(), trial_timeout, trial_memory, traces, rerun)
    folder = results_folder(chosen, out)
    given = {axis: found for axis, found in asdict(selection).items() if found}
    run_selected(chosen, folder, settings, f"dikbench.run_study({study!r}, **{given})")
    if report:
        write_report(folder)
    return load_results(folder)


def selected(study: str | None, selection: Selection) -> Study:
    """Return the study that a name or file and what replaces its axes select."""
    return select(load_study(study or DEFAULT_STUDY), selection, named=study is not None)


def results_folder(study: Study, out: str | Path | None) -> Path:
    """Return where a study's results go: the folder that was named, else runs/STUDY."""
    return Path(out) if out is not None else Path("runs") / study.name


def _texts(given: Selectors) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(map(str, given))
