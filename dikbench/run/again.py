"""The runs of trials that were run before, whose traces were not kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, NamedTuple

from dikbench.errors import DikbenchError
from dikbench.plugins.building_together import make_scenarios
from dikbench.results.columns import TRIAL
from dikbench.run.trial_row import Prepared, prepare
from dikbench.run.trials_together import in_lockstep, kind_of_trial
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.simulation.status import Status
from dikbench.study.identity import trial_id
from dikbench.study.trial import Trial
from dikbench.user_code import names_code

ENDED: Final = frozenset({Status.OK.value, Status.DIVERGED.value, Status.PROTECTIVE_STOP.value})
"""Of trials that came to an end by themselves."""


class RunAgain(NamedTuple):
    """A run of a trial that was run before.

    Attributes:
        id: of the trial.
        scenario: its case.
        run: the same run.
    """

    id: str
    scenario: Scenario
    run: Run


def same_here(rows: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Choose the rows whose trials ended and are the same here: their plug-ins have the source.

    Code in a file is left out: results may be from elsewhere, and what they name is not run.
    """
    found = []
    for row in rows:
        try:
            trial = _trial(row)
            parts = trial.formulation, trial.scenario, trial.solver, trial.plant
            if row["status"] not in ENDED or any(map(names_code, parts)):
                continue
            if trial_id(trial) == row["id"]:
                found.append(row)
        except DikbenchError:
            continue
    return found


def run_again(rows: Iterable[Mapping[str, Any]]) -> Iterator[RunAgain]:
    """Run the trials of rows of results again, those of one kind in lockstep.

    Left out is what does not come to the same: trials that cannot be built, and those whose run has
    another number of steps. Formulations can do what they like in this process.

    Args:
        rows: some of `same_here`.
    """
    groups: dict[object, list[tuple[Mapping[str, Any], Prepared]]] = {}
    for row, ready in _prepared(rows):
        kind = kind_of_trial(ready)
        groups.setdefault(row["id"] if kind is None else kind, []).append((row, ready))
    for group in groups.values():
        for (row, ready), run in zip(group, _runs([each for _, each in group]), strict=True):
            if run is not None and run.trace.steps == row["steps"]:
                yield RunAgain(row["id"], ready.scenario, run)


def _trial(row: Mapping[str, Any]) -> Trial:
    return Trial.of(**{name: row[name] for name in TRIAL})


def _prepared(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[Mapping[str, Any], Prepared]]:
    """Yield the rows whose scenarios can be built, and what their trials consist of."""
    trials = [(row, _trial(row)) for row in rows]
    new = dict.fromkeys((trial.scenario, trial.seed) for _, trial in trials)
    cells = [cell for cell in new if cell not in _BUILT]
    _BUILT.update(zip(cells, make_scenarios(cells), strict=True))
    for row, trial in trials:
        scenario = _BUILT[trial.scenario, trial.seed]
        if not isinstance(scenario, BaseException):
            ready = prepare(trial, scenario)
            if isinstance(ready, Prepared):
                yield row, ready


_BUILT: dict[tuple[Selector, int], Scenario | BaseException] = {}
"""The scenarios of this process, for the formulations to come."""


def _runs(ready: list[Prepared]) -> list[Run] | list[None]:
    """Run trials of one kind; one alone by itself. None where a formulation raised an error."""
    try:
        if len(ready) > 1:
            return [each.run for each in in_lockstep(ready)]
        [one] = ready
        return [
            simulate(
                one.scenario, one.formulation, one.solve(), one.plant, one.mode, one.trial.seed
            )
        ]
    except Exception:
        return [None] * len(ready)
