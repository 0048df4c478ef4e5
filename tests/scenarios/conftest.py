"""What the tests of the families share: a law's run over a scenario, by its metrics."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from dikbench.metrics import evaluate, motion_of
from dikbench.plugins.building import make_formulation, make_plant
from dikbench.problem import program_of
from dikbench.scenario import Scenario
from dikbench.simulation.closed_loop import simulate
from dikbench.simulation.status import Status
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve

Metrics = Callable[..., dict[str, float]]


@pytest.fixture
def metrics() -> Metrics:
    """(law, scenario, plant) -> every metric of a time-indexed run; with daqp where it needs one.

    The run must come to its end.
    """

    def of(law: str, scenario: Scenario, plant: str = "ideal") -> dict[str, float]:
        formulation = make_formulation(law)
        program = program_of(formulation)
        solve = make_solve(None if program is None else parse_solver("daqp"), program)
        run = simulate(scenario, formulation, solve, make_plant(plant))
        assert run.status is Status.OK
        return evaluate(motion_of(run.trace, scenario))

    return of
