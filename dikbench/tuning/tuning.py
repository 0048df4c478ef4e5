"""The tuning of formulations: tried on the train split, reported on the test split."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import msgspec
import pandas as pd
import tomli_w

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.plugins.finding import formulation_plugin
from dikbench.plugins.source import source_digest
from dikbench.plugins.tuned import Tuned, file_for, key_of, ranges_of, read_tuned
from dikbench.problem.problem import program_of
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import read_attempts, write_attempts
from dikbench.results.selected import with_selected
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study
from dikbench.scenario.oracle import ORACLE
from dikbench.selector import Selector
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER
from dikbench.study.study import Cells, Study, load_study
from dikbench.tuning.candidates import candidates
from dikbench.tuning.judging import Gain, Scores, gain, scores

TRAIN: Final = "train"
TEST: Final = "test"

HEAD: Final = "# Written by `dikbench tune --freeze`; `name[tuned]` selects these parameters.\n\n"


@dataclass(frozen=True, eq=False)
class Tuning:
    """What came of tuning one formulation.

    Attributes:
        name: of the formulation in `tuned.toml`.
        scores: how it did on the train split.
        entry: what is kept of it.
        gain: how it does on the test split; None before it was run there.
    """

    name: str
    scores: Scores
    entry: Tuned
    gain: Gain | None = None


def train_study(name: str) -> Study:
    """Read the study on which formulations are tuned.

    Raises:
        DikbenchError: if there is none, or it is not restricted to the train split.
    """
    study = load_study(name)
    if study.split != TRAIN:
        raise DikbenchError(
            f"study {study.name}: split = {study.split!r}; valid for tuning: a study with "
            f"split = {TRAIN!r}, so that what is reported was not used to choose"
        )
    if len(study.plants) > 1:
        raise DikbenchError(
            f"study {study.name}: plants = {list(study.plants)}; valid for tuning: one plant"
        )
    return msgspec.structs.replace(study, timing=None, example="")


def tune(
    formulations: Sequence[Selector],
    study: Study,
    budget: int,
    seed: int,
    out: Path,
    settings: RunSettings,
    command: str,
) -> Iterator[Tuning]:
    """Try each formulation at its default and at `budget` candidates, and choose the best.

    Args:
        formulations: with the parameters that stay.
        study: of the train split.
        budget: number of candidates.
        seed: of their sequence.
        out: the folder in which each formulation gets one of its own; what is there is kept.
        settings: how trials are run.
        command: the command line, for the manifests.

    Raises:
        DikbenchError: if a formulation has nothing to tune, or no trial of it counts.
        Interrupted: if the user stops the run.
    """
    tried = {str(each): candidates(each, budget, seed) for each in formulations}
    for number, default in enumerate(formulations, 1):
        chosen = tried[str(default)]
        asked = with_cells(study, [default, *chosen])
        name = key_of(default)
        _hand_over_instances(out, out / name)
        print(f"{default} ({number} of {len(formulations)})", file=sys.stderr)
        folder = run_study(asked, out / name, settings, command)
        _hand_over_instances(folder.path, out)
        scored = scores(_planned(folder), default, chosen)
        found = scored.best.parameters
        entry = Tuned(
            parameters={key: float(found[key]) for key in ranges_of(default) if key in found},
            study=study.name,
            seed=seed,
            budget=budget,
            source=source_digest(formulation_plugin(default.name)),
            success=round(scored.best_success, 4),
            default_success=round(float(scored.success[0]), 4),
        )
        yield Tuning(name, scored, entry)


def _hand_over_instances(known: Path, folder: Path) -> None:
    """Copy the instances of one folder to another that has none, so that they are drawn once."""
    if (attempts := read_attempts(known)) and not read_attempts(folder):
        folder.mkdir(parents=True, exist_ok=True)
        write_attempts(folder, attempts)


def report_on_test(
    tunings: Sequence[Tuning], out: Path, settings: RunSettings, command: str
) -> list[Tuning]:
    """Run the formulations at default, tuned and worst parameters on the test split.

    Raises:
        Interrupted: if the user stops the run.
    """
    study = msgspec.structs.replace(load_study(TEST), timing=None, example="")
    cells = [
        cell
        for each in tunings
        for cell in with_cells(
            study, [each.scores.default, each.scores.best, each.scores.worst]
        ).cells
    ]
    asked = msgspec.structs.replace(study, cells=tuple(cells))
    folder = run_study(asked, out / TEST, settings, command)
    trials = _planned(folder)
    return [replace(each, gain=gain(trials, each.scores)) for each in tunings]


def with_cells(study: Study, formulations: Sequence[Selector]) -> Study:
    """Return the study with these formulations only, each once, with their default solver.

    The oracle runs beside them, so that the facts of scenarios are known that they refuse.
    """
    program = program_of(make_formulation(formulations[0]))
    solvers = () if program is None else (DEFAULT_SOLVER[program],)
    names = tuple(dict.fromkeys(map(str, formulations)))
    return msgspec.structs.replace(study, cells=(Cells(names, solvers), Cells((ORACLE,))))


def _planned(folder: ResultsFolder) -> pd.DataFrame:
    """Read the rows that the last run in a folder asked for, without those of earlier ones."""
    with folder.open_store() as store:
        # Those of the last plan come first.
        return with_selected(store.trials().head(len(store.planned())))


def freeze(tunings: Sequence[Tuning]) -> list[Path]:
    """Write tuned parameters beside the files of their formulations, and keep those of others.

    Returns:
        The files that were written.

    Raises:
        DikbenchError: if a file cannot be read or written.
    """
    by_file: dict[Path, dict[str, Tuned]] = {}
    for each in tunings:
        by_file.setdefault(file_for(each.scores.default), {})[each.name] = each.entry
    for file, entries in by_file.items():
        write_tuned(file, {**read_tuned(file), **entries})
    return list(by_file)


def write_tuned(file: Path, entries: Mapping[str, Tuned]) -> None:
    """Write a file of tuned parameters, in the order of names.

    Raises:
        DikbenchError: if it cannot be written.
    """
    ordered = {name: msgspec.structs.asdict(entries[name]) for name in sorted(entries)}
    try:
        partial = file.with_name(file.name + ".partial")
        partial.write_text(HEAD + tomli_w.dumps(ordered), encoding="utf-8")
        partial.replace(file)
    except OSError as error:
        raise DikbenchError(f"file {file}: {error.strerror or error}") from None
