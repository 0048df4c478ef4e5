"""Many trials in lockstep, against each simulated alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
import pytest

from dikbench.arrays import Array
from dikbench.errors import Infeasible, SolverFailed
from dikbench.plugins.building import make_formulation, make_plant, make_scenario
from dikbench.problem import DikProblem, Solve, least_norm
from dikbench.problem.problem import Formulation, is_batched, program_of
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.clock import ReferenceMode
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.simulation.lockstep import (
    LockstepRun,
    LockstepTrial,
    kind_of,
    simulate_together,
)
from dikbench.simulation.status import STEP_CODE, Status
from dikbench.solvers.catalogue.back_ends import DEFAULT_SOLVER, parse_solver
from dikbench.solvers.checked_solve import CheckedSolve, make_solve

NEAR_MISSES = tuple(
    f"near-miss[robot=panda,dt=0.02,miss={miss},speed={speed}]"
    for miss, speed in ((0.005, 0.3), (0.02, 0.25), (0.04, 0.6), (0.01, 0.9))
)
KINDS = {
    "near misses": NEAR_MISSES,
    "limits": tuple(f"joint-limit-crossing[robot=ur5,dt=0.02,speed={s}]" for s in (0.3, 0.6)),
    "acceleration": tuple(f"speed-sweep[dt=0.02,acceleration=true,speed={s}]" for s in (0.5, 1.5)),
    "steps": tuple(f"step[robot=ur5,dt=0.02,distance={d}]" for d in (0.05, 0.1)),
    "positions": tuple(f"speed-sweep[robot=ur5,dt=0.02,rows=xyz,speed={s}]" for s in (0.4, 0.9)),
    "in the plane": ("hexagon[dt=0.02]", "hexagon[dt=0.02,speed=0.4]"),
    "outside": tuple(f"start-outside[dt=0.02,acceleration={a}]" for a in ("true", "false")),
}
WITHOUT_ANSWER = (Status.INFEASIBLE, Status.SOLVER_FAILED)
RECORDS = (
    "q", "tau", "wanted", "commanded", "applied", "status", "relaxed", "claimed", "verified",
    "primal", "dual", "gap", "distance",
)  # fmt: skip


@lru_cache(maxsize=64)
def _scenario(selector: str, seed: int = 0) -> Scenario:
    return make_scenario(selector, seed)


def _solve(formulation: Formulation) -> CheckedSolve:
    program = program_of(formulation)
    return make_solve(None if program is None else parse_solver(DEFAULT_SOLVER[program]), program)


def _together(
    scenarios: list[Scenario],
    formulation: Formulation,
    plant: str = "ideal",
    mode: ReferenceMode = "time",
    seeds: list[int] | None = None,
) -> list[LockstepRun]:
    numbers = range(len(scenarios)) if seeds is None else seeds
    trials = [
        LockstepTrial(scenario, formulation, _solve(formulation), seed, guesses=True)
        for scenario, seed in zip(scenarios, numbers, strict=True)
    ]
    return simulate_together(trials, make_plant(plant), mode)


def _alone(
    scenario: Scenario, formulation: Formulation, plant: str, mode: ReferenceMode, seed: int
) -> Run:
    return simulate(scenario, formulation, _solve(formulation), make_plant(plant), mode, seed)


def _assert_equal(together: Run, alone: Run, tolerance: float) -> None:
    """Assert that a run is the one alone; jumps of an active set grow, so of the same branch."""
    assert (together.status, together.message) == (alone.status, alone.message)
    assert together.trace.steps == alone.trace.steps
    for name in ("q", "tau", "wanted", "applied"):
        made, known = getattr(together.trace, name), getattr(alone.trace, name)
        assert made == pytest.approx(known, abs=tolerance * float(np.abs(known).max(initial=1.0)))
    for name in ("status", "relaxed", "claimed", "verified"):
        assert np.array_equal(getattr(together.trace, name), getattr(alone.trace, name)), name


LAWS = ("dls", "pinv[after=scale]", "qp", "lp-alpha", "nullspace")


@pytest.mark.parametrize(
    ("kind", "law"),
    [
        pytest.param(kind, law, marks=() if (2 * place - number) % 5 < 2 else pytest.mark.long)
        for place, kind in enumerate(KINDS)
        for number, law in enumerate(LAWS)
    ],
)
def test_trials_are_what_they_are_alone(kind: str, law: str) -> None:
    """Every kind of scenario by the clock; those of one group in one lockstep.

    The normal run has two laws of each kind, in turns.
    """
    formulation = make_formulation(law)
    groups: dict[Any, list[Scenario]] = {}
    for selector in KINDS[kind]:
        scenario = _scenario(selector)
        assert kind_of(scenario) is not None
        groups.setdefault(kind_of(scenario), []).append(scenario)
    for scenarios in groups.values():
        for seed, found in enumerate(_together(scenarios, formulation)):
            alone = _alone(scenarios[seed], formulation, "ideal", "time", seed)
            _assert_equal(found.run, alone, 1e-8)
            failed = np.isin(alone.trace.status, [STEP_CODE[each] for each in WITHOUT_ANSWER])
            assert found.asked_alone == (failed.sum() if is_batched(formulation) else len(failed))


@pytest.mark.parametrize("mode", ["time", "path"])
@pytest.mark.parametrize(
    "plant",
    ["saturating", "ideal[noise=1e-4,delay=2]", "saturating[noise=1e-5,delay=1]", "protective"],
)
@pytest.mark.parametrize("law", ["dls", "qp"])
def test_every_plant_and_clock(law: str, plant: str, mode: ReferenceMode) -> None:
    """Noise is each trial's own, delays and stops as well."""
    formulation, scenarios = make_formulation(law), [_scenario(each) for each in NEAR_MISSES[1:3]]
    for seed, found in enumerate(_together(scenarios, formulation, plant, mode)):
        _assert_equal(found.run, _alone(scenarios[seed], formulation, plant, mode, seed), 1e-8)


@pytest.mark.parametrize(
    ("law", "plant", "mode"),
    [
        pytest.param(law, *way, marks=() if (place + turn) % 2 == 0 else pytest.mark.long)
        for place, law in enumerate(
            ("dls", "pinv[after=clip]", "tsvd", "qp", "lp-alpha", "jparse", "hqp")
        )
        for turn, way in enumerate((("ideal", "time"), ("saturating[noise=1e-4]", "path")))
    ],
)
def test_a_trial_does_not_know_the_others(law: str, plant: str, mode: ReferenceMode) -> None:
    """To the bit, with whatever it runs beside: in another order, in a part, alone.

    The normal run has each law in one of two ways, in turns.
    """
    formulation, scenarios = make_formulation(law), [_scenario(each) for each in NEAR_MISSES]
    whole = _together(scenarios, formulation, plant, mode)
    for rows in ([3, 2, 1, 0], [0, 2], [1]):
        part = _together([scenarios[k] for k in rows], formulation, plant, mode, rows)
        for k, found in zip(rows, part, strict=True):
            for name in RECORDS:
                made, known = getattr(found.run.trace, name), getattr(whole[k].run.trace, name)
                assert np.array_equal(made, known, equal_nan=True), (k, name)
            assert found.asked_alone == whole[k].asked_alone
            assert np.array_equal(found.run.jacobians, whole[k].run.jacobians)


@dataclass(frozen=True)
class Fails:
    """J^+ V; goes wrong for the trial whose last joint is beyond an angle, in a way of its own."""

    how: str = "raise"
    beyond: float = 1.0

    batched: ClassVar[bool] = True

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Ask for one or many."""
        v = least_norm(problem.primary.J, problem.primary.V, 1e-6)
        wrong = problem.q[..., 6] > self.beyond
        return self._failed(v, np.atleast_1d(wrong), problem.robot.nv) if wrong.any() else v

    def _failed(self, v: Array, wrong: Array, nv: int) -> Any:
        if self.how == "nan":
            v = v.copy()
            v[wrong if v.ndim == 2 else ...] = np.nan
            return v
        if self.how == "shape":
            return np.zeros(nv + 1)
        if self.how == "diverge":
            v = v.copy()
            v[wrong if v.ndim == 2 else ...] = 1e7
            return v
        raise {
            "raise": ValueError("no"),
            "infeasible": Infeasible("none"),
            "failed": SolverFailed("none"),
        }[self.how]


def _moved(scenario: Scenario, angle: float) -> Scenario:
    """The same path with the last joint turned at the start, off it."""
    q0 = scenario.q0.copy()
    q0[6] = angle
    return replace(scenario, q0=q0)


@pytest.mark.parametrize("how", ["raise", "nan", "shape", "diverge", "infeasible", "failed"])
def test_a_row_that_goes_wrong_costs_the_others_nothing(how: str) -> None:
    """Its status and message are those of a run alone; the others keep every bit."""
    near = _scenario(NEAR_MISSES[1])
    scenarios = [_moved(near, angle) for angle in (0.6, 1.4, 0.9)]
    formulation = Fails(how)
    found = _together(scenarios, formulation)
    for seed, scenario in enumerate(scenarios):
        alone = _alone(scenario, formulation, "ideal", "time", seed)
        _assert_equal(found[seed].run, alone, 1e-8)
    assert found[1].asked_alone > 0 or how == "diverge"
    assert found[0].asked_alone == found[2].asked_alone == 0
    others = _together([scenarios[0], scenarios[2]], formulation, seeds=[0, 2])
    for row, k in enumerate((0, 2)):
        assert np.array_equal(others[row].run.trace.q, found[k].run.trace.q)
    assert (found[1].run.status is Status.OK) == (how in {"infeasible", "failed"})


def test_a_formulation_that_writes_to_its_rows_is_asked_alone() -> None:
    """What it is handed together is read-only, and what it is handed alone is its own."""

    @dataclass(frozen=True)
    class Writes:
        batched: ClassVar[bool] = True

        def velocity(self, problem: DikProblem, solve: Solve) -> Array:
            problem.primary.V *= 1.0
            return least_norm(problem.primary.J, problem.primary.V, 1e-6)

    scenarios = [_scenario(each) for each in NEAR_MISSES[:2]]
    for seed, found in enumerate(_together(scenarios, Writes())):
        alone = _alone(scenarios[seed], Writes(), "ideal", "time", seed)
        assert found.run.status is alone.status is Status.FORMULATION_ERROR
        assert found.run.message == alone.message


@pytest.mark.parametrize(
    "selector",
    [
        "obstacle",
        "torque-limited",
        "task-conflict",
        "humanoid",
        "back-and-forth[robot=ur5,rows=xyzrx]",
    ],
)
def test_what_runs_alone(selector: str) -> None:
    """Rows G v <= h, tasks of one priority or on other frames, single turns."""
    assert kind_of(_scenario(selector)) is None


def test_what_is_not_of_one_kind() -> None:
    """Another robot, period, gain, limit or row."""
    base = "speed-sweep[robot=ur5,dt=0.02"
    others = ["", ",gain=3", ",acceleration=true", ",rows=xyz", ",velocity=2"]
    scenarios = [_scenario(f"{base}{other}]") for other in others]
    scenarios += [_scenario("speed-sweep[robot=ur5,dt=0.01]"), _scenario("speed-sweep[dt=0.02]")]
    kinds = [kind_of(scenario) for scenario in scenarios]
    assert None not in kinds
    assert len(set(kinds)) == len(kinds)
    assert kind_of(_scenario(f"{base},speed=0.7]")) == kinds[0]
