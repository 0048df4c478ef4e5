"""The blocks of trials that a worker runs at a time, and the engine of a study."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Final, Literal

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_formulation
from dikbench.problem.problem import is_batched
from dikbench.results.store import Store
from dikbench.scenario.oracle import ORACLES
from dikbench.selector import Selector
from dikbench.study.plan import PlannedTrial

Engine = Literal["alone", "lockstep"]
"""Whether each trial runs alone, or those of one kind in lockstep."""

EngineChoice = Literal["auto", "alone", "lockstep"]

LEAST_ROWS: Final = 64
"""Lockstep pays from so many trials of one formulation, family, robot and plant on."""

MOST_SCENARIOS: Final = 128
"""Largest number of scenarios of a block ..."""

MOST_TRIALS: Final = 1024
"""... and of its trials: what is lost where a run is killed."""

BLOCKS_PER_WORKER: Final = 2
"""Fewest blocks for each worker, so that all end at about the same time."""

SECONDS_PER_TRIAL: Final = 1.0
"""Wall-clock time of a block beyond the limit of one trial, for each of its trials."""


def engine_of(planned: Sequence[PlannedTrial], choice: EngineChoice, store: Store) -> Engine:
    """Choose the engine of a study; that of the rows which it already has stays.

    Args:
        planned: its trials.
        choice: the engine, or `auto`: lockstep where the references move with the clock, and
            `LEAST_ROWS` trials, on average, of each formulation that answers many at once share
            family, robot and plant: a thousand formulations on one scenario are a thousand groups
            of one. Where a reference waits, runs are of very different lengths, and the
            last ones of a lockstep cost as much as all.
        store: of the results.

    Raises:
        DikbenchError: if the rows are of another engine than the one that is chosen.
    """
    try:
        there = store.manifest().get("engine", "alone") if store.statuses() else None
    except DikbenchError:  # nothing was run
        there = None
    if there is not None:
        if choice not in ("auto", there):
            raise DikbenchError(
                f"store {store.path}: its trials ran with engine={there}; valid: that, or another "
                "folder with --out"
            )
        return "lockstep" if there == "lockstep" else "alone"
    if choice != "auto":
        return choice
    trials = [p.trial for p in planned if not p.skip]
    if any(trial.reference != "time" for trial in trials):
        return "alone"
    kinds = Counter(
        (trial.formulation, trial.solver, *family_and_robot(trial.scenario), trial.plant)
        for trial in trials
        if trial.formulation.name not in ORACLES and is_batched(make_formulation(trial.formulation))
    )
    return "lockstep" if kinds and kinds.total() / len(kinds) >= LEAST_ROWS else "alone"


def blocks_of(ordered: Sequence[PlannedTrial], jobs: int) -> list[list[PlannedTrial]]:
    """Divide trials, those of a scenario together, into blocks for a number of workers.

    Scenarios of one family and robot are next to each other, since they can be built and run
    together.
    """
    scenarios = [
        list(group) for _, group in groupby(ordered, key=lambda p: (p.trial.scenario, p.trial.seed))
    ]
    scenarios.sort(key=lambda trials: family_and_robot(trials[0].trial.scenario))
    most = max(1, min(MOST_SCENARIOS, len(scenarios) // (BLOCKS_PER_WORKER * jobs)))
    blocks: list[list[PlannedTrial]] = []
    held = 0
    for trials in scenarios:
        if not blocks or held == most or len(blocks[-1]) + len(trials) > MOST_TRIALS:
            blocks.append([])
            held = 0
        blocks[-1] += trials
        held += 1
    return blocks


def family_and_robot(scenario: Selector) -> tuple[str, str]:
    """Return what scenarios share that can be built and run together."""
    return scenario.name, str(dict(scenario.parameters).get("robot", ""))


def block_timeout(trials: int, trial_timeout: float) -> float:
    """Return the wall-clock limit of a block of trials [s] by that of a trial [s]."""
    return trial_timeout + SECONDS_PER_TRIAL * (trials - 1)


def smaller(block: Sequence[PlannedTrial]) -> Iterator[list[PlannedTrial]]:
    """Divide a block that ended its worker: by formulation, and then into its trials.

    A formulation that hangs or ends its process thus costs its own rows only.
    """
    by_formulation: dict[object, list[PlannedTrial]] = {}
    for p in block:
        key = p.trial.formulation, p.trial.solver
        by_formulation.setdefault(key, []).append(p)
    if len(by_formulation) > 1:
        yield from by_formulation.values()
    else:
        yield from ([p] for p in block)
