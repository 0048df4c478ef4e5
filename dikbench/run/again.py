"""The runs of trials that were run before, whose traces were not kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from dikbench.errors import DikbenchError
from dikbench.plugins.building_together import make_scenarios
from dikbench.results.columns import TRIAL
from dikbench.run.trial_row import Prepared, prepare
from dikbench.run.trials_together import in_lockstep, kind_of_trial
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.study.identity import trial_id
from dikbench.study.trial import Trial


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


def run_again(rows: Iterable[Mapping[str, Any]]) -> Iterator[RunAgain]:
    """Run the trials of rows of results again, those of one kind in lockstep.

    Left out is what does not come to the same here: trials whose plug-ins are not found or have
    another source, or whose run has another number of steps. Whoever asks must know that they end:
    nothing limits their time.
    """
    groups: dict[object, list[tuple[Mapping[str, Any], Prepared]]] = {}
    for row, ready in _prepared(rows):
        kind = kind_of_trial(ready)
        groups.setdefault(row["id"] if kind is None else kind, []).append((row, ready))
    for group in groups.values():
        for (row, ready), run in zip(group, _runs([each for _, each in group]), strict=True):
            if run is not None and run.trace.steps == row["steps"]:
                yield RunAgain(row["id"], ready.scenario, run)


def _prepared(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[Mapping[str, Any], Prepared]]:
    """Yield the rows whose trials are the same here, and what they consist of."""
    known = []
    for row in rows:
        try:
            trial = Trial.of(**{name: row[name] for name in TRIAL})
            if trial_id(trial) == row["id"]:
                known.append((row, trial))
        except DikbenchError:
            continue
    cells = list(dict.fromkeys((trial.scenario, trial.seed) for _, trial in known))
    built = dict(zip(cells, make_scenarios(cells), strict=True))
    for row, trial in known:
        scenario = built[trial.scenario, trial.seed]
        if isinstance(scenario, BaseException):
            continue
        ready = prepare(trial, scenario)
        if isinstance(ready, Prepared):
            yield row, ready


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
