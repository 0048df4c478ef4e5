"""Many scenarios built at once: their joint motions are solved together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextvars import copy_context
from itertools import islice
from typing import Final

from greenlet import getcurrent, greenlet

from dikbench.plugins.building import make_scenario
from dikbench.plugins.time_limit import others_may_run
from dikbench.scenario.placing import PURSUED_BY, Pursuit, pursue
from dikbench.scenario.scenario import Scenario
from dikbench.selector import Selector

MOST_TOGETHER: Final = 256
"""So many are built at once: more are hardly faster."""

Cell = tuple[str | Selector, int]
"""Selector and seed of a scenario."""


def make_scenarios(cells: Iterable[Cell]) -> Iterator[Scenario | BaseException]:
    """Build the scenarios of selectors and seeds; each is the one of `make_scenario`, to the bit.

    Each building runs in a greenlet of its own, as the ordinary code that it is, up to where it
    needs configurations for placements; these are then solved for all that wait.

    Args:
        cells: selector and seed of each.

    Yields:
        The scenario, or what its building raised, which costs the others nothing. Only
        `KeyboardInterrupt` ends all.
    """
    waiting = iter(cells)
    while some := list(islice(waiting, MOST_TOGETHER)):
        yield from _together(some)


def _together(cells: list[Cell]) -> list[Scenario | BaseException]:
    buildings = [_Building(cell) for cell in cells]
    with others_may_run():  # a limit around this is not one of theirs
        running = [(each, each.go_on()) for each in buildings]
        while running := [(each, needed) for each, needed in running if needed is not None]:
            pursue(needed for _, needed in running)
            running = [(each, each.go_on()) for each, _ in running]
    return [each.outcome for each in buildings]


class _Building:
    """The building of one scenario, which stops where it needs configurations.

    Attributes:
        outcome: the scenario, or what was raised.
    """

    outcome: Scenario | BaseException

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._greenlet = greenlet(self._run)
        self._greenlet.gr_context = copy_context()

    def go_on(self) -> Pursuit | None:
        """Build until configurations are needed; None once there is an outcome."""
        needed: Pursuit | None = self._greenlet.switch()
        return needed

    def _run(self) -> None:
        PURSUED_BY.set(self._wait)
        try:
            self.outcome = make_scenario(*self._cell)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            self.outcome = error

    def _wait(self, pursuit: Pursuit) -> None:
        """Let others build until the pursuit is done."""
        if not pursuit.is_ours:  # a plug-in's own task may not stop, and has its limit here
            pursue([pursuit])
            return
        parent = getcurrent().parent
        assert parent is not None
        with others_may_run():
            parent.switch(pursuit)
