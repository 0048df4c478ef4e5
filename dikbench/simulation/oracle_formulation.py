"""The exact joint motion of a scenario as a formulation, for the oracle's row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pinocchio as pin

from dikbench.arrays import Array
from dikbench.problem.problem import DikProblem, Formulation, Solve
from dikbench.scenario.oracle import ORACLE
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.slowed_oracle import SlowedOracle


@dataclass(frozen=True, eq=False)
class OracleFormulation:
    """Commands the velocities of a known joint motion in sequence, for one run.

    Attributes:
        velocities: (nv,) [rad/s] each, one per control step.
    """

    velocities: Iterator[Array]

    @classmethod
    def of(cls, scenario: Scenario) -> OracleFormulation:
        """Command the joint motion from which a scenario's path was built (`Scenario.oracle`)."""
        q = scenario.oracle
        assert q is not None
        model, dt = scenario.robot.model, scenario.dt
        return cls(pin.difference(model, q[k], q[k + 1]) / dt for k in range(len(q) - 1))

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """Command the next velocity."""
        return next(self.velocities)


def oracle_of(name: str, scenario: Scenario) -> Formulation | None:
    """Make the oracle of a scenario by its name in `ORACLES`; None where no motion is known."""
    if name == ORACLE:
        return None if scenario.oracle is None else OracleFormulation.of(scenario)
    return None if scenario.witness is None else SlowedOracle(scenario)
