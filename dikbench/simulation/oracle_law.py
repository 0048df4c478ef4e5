"""The joint motion behind a scenario, played to the harness like a law: the oracle row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Solve
from dikbench.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class Replay:
    """Commands given velocities one after the other, whatever the problem: not a law.

    Attributes:
        velocities: (nv,) [rad/s] each, one per control step.
    """

    velocities: Iterator[Array]

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """The next one."""
        return next(self.velocities)


def replay_of(scenario: Scenario) -> Replay:
    """The joint motion from which a scenario's path was built (see `Scenario.oracle`)."""
    q = scenario.oracle
    assert q is not None
    model, dt = scenario.robot.model, scenario.dt
    return Replay(pin.difference(model, q[k], q[k + 1]) / dt for k in range(len(q) - 1))
