"""Scenarios that are built together are those that are built alone, to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.plugins import building
from dikbench.plugins.building import make_scenario
from dikbench.plugins.building_together import Cell, make_scenarios
from dikbench.plugins.finding import plugins
from dikbench.scenario.family import certified_robots
from dikbench.scenario.scenario import Scenario

CELLS: list[Cell] = [
    ("near-miss[robot=panda]", 1),
    ("near-miss[robot=panda,miss=0.0178,speed=0.27]", 2),
    ("near-miss[robot=ur5]", 3),
    ("hexagon[robot=planar4r]", 1),  # the position alone
    ("reach[robot=panda]", 4),
    ("near-miss[robot=panda,velocity=1.5]", 1),  # the model of others, other limits
    ("step[robot=tiago]", 1),  # joints that slide
    ("speed-sweep[robot=planar3r]", 2),
    ("log-derivative-drift", 0),  # a base whose coordinates are not its velocities
]

BROKEN = '''
from dataclasses import dataclass
import sys
import numpy as np
import pinocchio as pin
from dikbench.problem import PoseTask
from dikbench.scenario import Case, Family, Reference, placement_of, screw_path, solve_placement


class Mine(PoseTask):
    """A task that breaks a little later."""

    calls = [0]
    end = "raise"

    def linearize(self, kinematics, target=None, velocity=None):
        self.calls[0] += 1
        while self.end == "never" and self.calls[0] > 3:
            pass
        if self.calls[0] > 3:
            raise ValueError("enough")
        return super().linearize(kinematics, target, velocity)


class Never(Mine):
    calls = [0]
    end = "never"


@dataclass(frozen=True, kw_only=True)
class Broken(Family):
    """Waits for one configuration, then breaks as it is asked to."""

    robot: str = "panda"
    how: str = "raises"

    def case(self, robot, change):
        here = placement_of(robot, robot.q0)
        q0 = solve_placement(robot, here * pin.exp6(pin.Motion(np.full(6, 0.01))), robot.q0)
        if self.how == "raises":
            raise ZeroDivisionError("as asked")
        if self.how == "exits":
            sys.exit("as asked")
        if self.how == "hangs":
            while True:
                try:
                    sum(range(1000))
                except Exception:
                    continue
        if self.how == "far":
            solve_placement(robot, pin.SE3(np.eye(3), np.array([9.0, 0, 0])), q0, iterations=20)
        if self.how == "twisted":
            bad = pin.SE3(here)
            bad.rotation = 2 * here.rotation
            self.exact_motion(robot, Reference(1.0, lambda tau: bad, lambda tau: np.zeros(6)), q0)
        if self.how in ("task", "task-hangs"):
            path = screw_path(placement_of(robot, q0), np.full(6, 0.01), 1.0)
            task = Mine() if self.how == "task" else Never()
            self.exact_motion(robot, path, q0, task)
        return None
'''


def numbers(scenario: Scenario) -> list[Any]:
    """List everything of a scenario that a trial could depend on."""
    motion, claims = scenario.motion, scenario.certificate.claims
    return [
        *(scenario.q0, scenario.v0, *scenario.target_arrays),
        *((motion.instants, motion.q, motion.v, motion.sigma_min, motion.reach) if motion else ()),
        [(claim.quantity, float(claim.value)) for claim in claims],
        (scenario.duration, scenario.tolerance_m, scenario.feasible, scenario.situation),
        (scenario.followable_until, scenario.comes_back, scenario.infeasible_because),
    ]


def assert_same(first: object, second: object) -> None:
    """Two outcomes are the same scenario, to the bit, or the same error."""
    if not isinstance(first, Scenario) or not isinstance(second, Scenario):
        assert (type(first), str(first)) == (type(second), str(second))
        return
    for one, other in zip(numbers(first), numbers(second), strict=True):
        same = np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other
        assert same, (one, other)


def alone(cell: Cell) -> Scenario | BaseException:
    """Build one scenario as it always was."""
    try:
        return make_scenario(*cell)
    except (DikbenchError, SystemExit) as error:
        return error


@pytest.fixture(scope="module")
def by_themselves() -> dict[Cell, Scenario | BaseException]:
    """Each of the cells built alone."""
    return {cell: alone(cell) for cell in CELLS}


@pytest.mark.parametrize(
    "chosen", [slice(None), slice(None, None, -1), slice(1, 8, 3), slice(0, 1), slice(2, 6)]
)
def test_a_scenario_does_not_know_its_neighbours(
    by_themselves: dict[Cell, Scenario | BaseException], chosen: slice
) -> None:
    """All of them, in either order, and some of them: of several families, robots and tasks."""
    cells = CELLS[chosen]
    for cell, made in zip(cells, make_scenarios(cells), strict=True):
        assert isinstance(made, Scenario)
        assert_same(made, by_themselves[cell])


def test_more_than_are_built_at_once_come_in_their_order(
    monkeypatch: pytest.MonkeyPatch, by_themselves: dict[Cell, Scenario | BaseException]
) -> None:
    """In groups, the last of which is smaller; of none there are none."""
    monkeypatch.setattr("dikbench.plugins.building_together.MOST_TOGETHER", 2)
    cells = [CELLS[2], CELLS[4], CELLS[0]]
    for cell, made in zip(cells, make_scenarios(iter(cells)), strict=True):
        assert_same(made, by_themselves[cell])
    assert list(make_scenarios([])) == []


@pytest.mark.long
def test_every_family_is_the_same_together_and_alone() -> None:
    """Each on the robots of which it is certified the first and the last, at two seeds."""
    cells: list[Cell] = []
    for name, family in plugins("scenario").items():
        if any(parameter.required for parameter in family.parameters.values()):
            continue
        robots = certified_robots(family.factory)
        cells += [
            (f"{name}[robot={robot}]", seed) for robot in {robots[0], robots[-1]} for seed in (0, 5)
        ]
    assert len(cells) > 60
    for cell, made in zip(cells, make_scenarios(cells), strict=True):
        assert_same(made, alone(cell))


def test_what_breaks_one_building_costs_the_others_nothing(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    by_themselves: dict[Cell, Scenario | BaseException],
) -> None:
    """Wrong texts, errors before and after it waits, an exit, endless loops, what is too far."""
    monkeypatch.setattr(building, "LONGEST_BUILDING_S", 0.5)
    path = tmp_path / "broken.py"
    path.write_text(BROKEN)
    ends = {
        "raises": "ZeroDivisionError: as asked",
        "exits": "as asked",
        "hangs": "its building takes longer than 0.5 s",
        "far": "no posture found for the placement, residual",
        "twisted": "is not a rotation",
        "task": "ValueError: enough",
        "task-hangs": "its building takes longer than 0.5 s",
    }
    wrong: dict[Cell, str] = {(f"{path}:Broken[how={how}]", 0): said for how, said in ends.items()}
    wrong["near-miss[robot=nobody]", 0] = "unknown robot"
    wrong["near-miss[miss=9]", 0] = "miss"
    wrong["no-such-family", 0] = "no-such-family"
    wrong["near-miss[robot=panda]", -1] = "must not be negative"
    good = [CELLS[0], CELLS[2], CELLS[4]]
    cells = [good[0], *list(wrong)[:5], good[1], *list(wrong)[5:], good[2]]
    outcomes = dict(zip(cells, make_scenarios(cells), strict=True))
    for cell in good:
        assert_same(outcomes[cell], by_themselves[cell])
    for cell, said in wrong.items():
        assert said in str(outcomes[cell]), cell
    assert isinstance(outcomes[cells[2]], SystemExit)


def test_an_interruption_by_the_user_ends_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not the outcome of a cell."""

    def interrupted(*cell: object) -> Scenario:
        raise KeyboardInterrupt

    monkeypatch.setattr("dikbench.plugins.building_together.make_scenario", interrupted)
    with pytest.raises(KeyboardInterrupt):
        list(make_scenarios(CELLS[:2]))
