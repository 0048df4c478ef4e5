"""The search for the scenario of a family in which a formulation does worst."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from dikbench.advice.badness import Badness, badness_of, worse_by
from dikbench.advice.contender import Contender
from dikbench.advice.evaluating import Evaluate
from dikbench.advice.searched import Searched
from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.drawing import Cell
from dikbench.run.trial_row import TrialRow
from dikbench.selector import Selector
from dikbench.study.trial import Trial

GENERATIONS: Final = 20
"""Generations of the search: the first is spread evenly, each further one improves on the last."""

FEWEST_IN_GENERATION: Final = 8
"""Differential evolution stalls with fewer."""


@dataclass(frozen=True)
class Tried:
    """A case that was tried.

    Attributes:
        scenario, seed: the case.
        rows: the row of each contender.
        badness: how bad it was for each; None where the case does not count.
    """

    scenario: Selector
    seed: int
    rows: tuple[TrialRow, ...]
    badness: tuple[Badness | None, ...]

    @property
    def value(self) -> float:
        """What the search makes as large as it can; -inf where the case does not count."""
        if None in self.badness:
            return -np.inf
        first, *others = [each for each in self.badness if each is not None]
        return worse_by(first, others[0]) if others else first.number


@dataclass(frozen=True)
class Search:
    """What came of a search.

    Attributes:
        contenders: who was searched for, and who is compared with, if anybody.
        tried: every case, each once, in the order in which they were tried.
    """

    contenders: tuple[Contender, ...]
    tried: tuple[Tried, ...]

    @property
    def worst(self) -> Tried:
        """The worst case, the first one found of several as bad."""
        return max(self.tried, key=lambda each: each.value)

    @property
    def counted(self) -> list[Tried]:
        """The cases that count."""
        return [each for each in self.tried if None not in each.badness]


def search_worst(
    box: Searched,
    contenders: Sequence[Contender],
    evaluate: Evaluate,
    *,
    budget: int,
    seed: int,
    plant: Selector,
    reference: str,
    progress: Callable[[int], object] = lambda _: None,
) -> Search:
    """Search a box of scenarios for the one in which the first contender does worst.

    Where there is a second one, it is the one in which the first does worst against it (see
    `worse_by`). Differential evolution in 20 generations; the first
    population are points of a scrambled Sobol sequence. Cases that do not count for each contender
    (see `badness_of`) are passed over.

    Args:
        box: what is searched.
        contenders: one, or two.
        evaluate: runs trials.
        budget: number of cases.
        seed: of the search.
        plant: of all trials.
        reference: `time` or `path`.
        progress: is told how many more cases are tried.

    Raises:
        DikbenchError: if no case counts; with the most frequent reason.

    Source: Storn & Price 1997, Differential evolution; scipy's implementation.
    """
    found: dict[Cell, Tried] = {}

    def values(points: Array) -> Array:
        """Return what is minimised at points (d, n), (n,)."""
        cells = [box.cell_at(point) for point in points.T]
        new = [cell for cell in dict.fromkeys(cells) if cell not in found]
        trials = [
            Trial(each.formulation, scenario, each.solver, plant, reference, number)
            for scenario, number in new
            for each in contenders
        ]
        rows = evaluate(trials)
        for place, (scenario, number) in enumerate(new):
            own = tuple(rows[place * len(contenders) : (place + 1) * len(contenders)])
            found[scenario, number] = Tried(scenario, number, own, tuple(map(badness_of, own)))
        progress(len(cells))
        return np.array([-found[cell].value for cell in cells])

    size = max(FEWEST_IN_GENERATION, budget // GENERATIONS)
    differential_evolution(
        values,
        box.bounds,
        init=_spread(box, size, seed),
        maxiter=max(budget // size - 1, 0),
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        integrality=box.whole,
        rng=np.random.default_rng(seed),
    )
    search = Search(tuple(contenders), tuple(found.values()))
    if not search.counted:
        raise DikbenchError(
            f"scenario {box.given}: none of {len(found)} cases counts; the most frequent reason: "
            f"{_most_frequent_reason(search)}"
        )
    return search


def _spread(box: Searched, size: int, seed: int) -> Array:
    """Spread points over a box, (size, d)."""
    sequence = qmc.Sobol(len(box.axes), scramble=True, rng=np.random.default_rng(seed))
    points = sequence.random_base2(int(np.ceil(np.log2(size))))[:size]
    low, high = np.array(box.bounds).T
    whole = np.minimum(np.floor(points * (high + 1)), high)
    spread: Array = np.where(box.whole, whole, low + points * (high - low))
    return spread


def _most_frequent_reason(search: Search) -> str:
    """Say why cases do not count."""
    reasons = Counter(
        row["message"] or f"what it asks for is feasible: {row.get('feasible')}"
        for each in search.tried
        for row, bad in zip(each.rows, each.badness, strict=True)
        if bad is None
    )
    return reasons.most_common(1)[0][0]
