"""Short runs on which plants and metrics are checked."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from dikbench.problem.problem import Formulation
from dikbench.robots.robot import Robot
from dikbench.scenario.building import placement_of, usual_claims
from dikbench.scenario.family import Case, Family
from dikbench.scenario.plant import Ideal
from dikbench.scenario.reference.waypoints import through
from dikbench.scenario.scenario import Scenario
from dikbench.scenario.variation import Perturbation
from dikbench.simulation.closed_loop import Run, simulate
from dikbench.solvers.checked_solve import make_solve
from dikbench.testing.straw import Idle, Jittery, Reckless


@dataclass(frozen=True, kw_only=True)
class _Line(Family):
    """A short line of an arm in the plane, followed and then held."""

    robot: str = "planar3r"
    gain: float = 20.0

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        start = placement_of(robot, robot.q0)
        end = pin.SE3(start.rotation, start.translation + np.array([0.0, 0.02, 0.0]))
        reference = through([0.0, 0.1], [start, end], smooth=False)
        motion = self.exact_motion(robot, reference, robot.q0)
        return Case(reference, robot.q0, motion, usual_claims(motion, speed=(0.0, 1.0)))


@lru_cache(maxsize=1)
def slow_line() -> Scenario:
    """Return the scenario, built once."""
    return _Line().scenario(0)


class Moved(NamedTuple):
    """A run and what it is of."""

    label: str
    scenario: Scenario
    run: Run


def moved() -> Iterator[Moved]:
    """Run straw laws: one follows, one stands still, one shakes."""
    laws: tuple[tuple[str, Formulation], ...] = (
        ("a run that follows", Reckless()),
        ("a run that stands still", Idle()),
        ("a run that shakes", Jittery()),
    )
    for label, law in laws:
        scenario = slow_line()
        yield Moved(
            label, scenario, simulate(scenario, law, make_solve(None, None), Ideal(), "time", 0)
        )
