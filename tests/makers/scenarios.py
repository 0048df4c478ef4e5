"""Makers of scenarios, of formulations that are functions, and of their runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from typing import Any, Final

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.metrics import evaluate, motion_of
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem import DikProblem, Formulation, PoseTask, Solve
from dikbench.robots.loading import load_robot
from dikbench.scenario import (
    Certificate,
    Robot,
    Scenario,
    Singularity,
    analyse,
    joint_path,
    make_singular,
)
from dikbench.scenario.plant import Ideal, Plant
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.simulation.status import Status
from dikbench.solvers.checked_solve import CheckedSolve, make_solve
from makers.problems import solve_for
from scenarios import SCENARIOS
from scenarios.singular_postures import SINGULAR_POSTURES, SingularPosture

RATE = np.array([0.5, -0.4, 0.6])
"""Of the joints of `planar_scenario` [rad/s]."""

TWENTY_SEEDS = [range(2), pytest.param(range(2, 21), marks=pytest.mark.long)]
"""Seeds for what must hold from any start: a few in the normal run, the others in the long one."""


scenario_of = lru_cache(maxsize=256)(make_scenario)
"""Makes the scenario of a selector and a seed once, for tests that only look at it."""


CLOSED: Final = [name for name in SCENARIOS if name != "csv"]
"""Families that need nothing from outside; the others have tests of their own."""


def planar_scenario(
    *,
    dt: float = 0.01,
    duration: float = 0.3,
    rate: Array = RATE,
    gain: float = 2.0,
    **limits: Any,
) -> Scenario:
    """Make a planar arm that is to follow the pose of q0 + t rate, from its own velocity on."""
    robot = load_robot("planar3r").with_limits(**limits)
    q0 = np.array([0.4, 0.8, 0.7])
    return Scenario(
        robot=robot,
        q0=q0,
        v0=rate.copy(),
        reference=joint_path(robot, lambda tau: q0 + tau * rate, lambda tau: rate, duration),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=Certificate(()),
    )


class Recording:
    """A formulation made of a function of the problem; it keeps the problems that it saw."""

    def __init__(self, velocity: Callable[[DikProblem], Any]) -> None:
        self.answer = velocity
        self.seen: list[DikProblem] = []

    def velocity(self, problem: DikProblem, solve: Solve) -> Any:
        """See `Formulation`."""
        self.seen.append(problem)
        return self.answer(problem)


def exact(problem: DikProblem) -> Array:
    """Compute the velocity that does the task."""
    return np.linalg.solve(problem.primary.J, problem.primary.V).astype(np.float64, copy=False)


def at_step(k: int, wrong: Callable[[], Any]) -> Callable[[DikProblem], Any]:
    """Make a formulation that does the task until step k, and then something wrong."""
    steps = iter(range(10**6))
    return lambda problem: wrong() if next(steps) == k else exact(problem)


def raises(error: BaseException) -> Any:
    """Raise an error, where only an expression may stand."""
    raise error


def run_on_planar(
    law: Formulation | Callable[[DikProblem], Any],
    scenario: Scenario | None = None,
    *,
    plant: Plant | None = None,
    mode: Any = "time",
    solve: CheckedSolve | None = None,
) -> Run:
    """Run a formulation, or a function of the problem, by default over `planar_scenario`."""
    formulation = law if isinstance(law, Formulation) else Recording(law)
    chosen = make_solve(None, None) if solve is None else solve
    return simulate(scenario or planar_scenario(), formulation, chosen, plant or Ideal(), mode)


def run_of(law: str, scenario: Scenario, *, plant: str = "ideal", solver: str = "daqp") -> Run:
    """Run a formulation over a scenario, time-indexed; the run must come to its end."""
    formulation = make_formulation(law)
    run = simulate(scenario, formulation, solve_for(formulation, solver), make_plant(plant))
    assert run.status is Status.OK
    return run


def metrics_of(law: str, scenario: Scenario, plant: str = "ideal") -> dict[str, float]:
    """Evaluate every metric of such a run."""
    return evaluate(motion_of(run_of(law, scenario, plant=plant).trace, scenario))


def error_of(make: Callable[..., object], *args: object) -> str:
    """Catch the error of the user that a call ends in: one line."""
    with pytest.raises(DikbenchError) as caught:
        make(*args)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def scenario_error(selector: str) -> str:
    """Catch likewise the error of the scenario that a selector stands for."""
    return error_of(make_scenario, selector)


def put_robot(monkeypatch: pytest.MonkeyPatch, robot: object) -> None:
    """Make every family find this robot, whatever the name that it asks for."""
    module = sys.modules["dikbench.scenario.family"]
    monkeypatch.setattr(module, "load_robot", lambda *_, **__: robot)


@cache
def known_singularity(robot: str, name: str) -> tuple[Robot, Singularity]:
    """Load a robot, and find its singular configuration of a name in `SINGULAR_POSTURES`."""
    arm = load_robot(robot)
    postures: Mapping[Any, SingularPosture] = SINGULAR_POSTURES[robot]
    near = pin.integrate(arm.model, pin.neutral(arm.model), np.array(postures[name].posture))
    return arm, analyse(arm, make_singular(arm, near))
