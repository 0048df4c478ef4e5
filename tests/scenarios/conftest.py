"""What the tests of the families share: a law's run over a scenario, by its metrics."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from dikbench.metrics import evaluate
from dikbench.motion import recompute
from dikbench.problem import program_of
from dikbench.registry import make_formulation, make_plant
from dikbench.scenario import Scenario
from dikbench.simulation import simulate
from dikbench.solvers.catalogue import parse_solver
from dikbench.solvers.checked import make_solve
from dikbench.status import Status

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
        return evaluate(recompute(run.trace, scenario))

    return of
