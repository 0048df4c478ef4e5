"""Straw laws: formulations that nobody should choose, which no benchmark may let win.

They are for checking a benchmark (`dikbench check --benchmark STUDY`), and are named in a study by
this file: `path/to/dikbench/testing/straw.py:Idle`. In addition to them the `slowed-oracle`, the
best that can be done, must succeed wherever something can.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import cycle
from typing import Annotated, Final

import numpy as np

from dikbench.arrays import Array
from dikbench.linear_algebra import least_norm
from dikbench.parameters import Parameters, Range
from dikbench.problem.problem import DikProblem, Solve
from dikbench.robots.limits import Interval

RANK_TOLERANCE: Final = 1e-6
"""Singular values up to this (m, rad) count as zero."""


@dataclass(frozen=True)
class Idle(Parameters):
    """Stands still: v = 0. It breaks no limit that a robot at rest does not break."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return np.zeros(problem.robot.nv)


@dataclass(frozen=True)
class Creeper(Parameters):
    """Follows at a crawl: v = share s J^+ V, with s as in `Jittery`.

    Attributes:
        share: share of the scaled least-norm velocity.
    """

    share: Annotated[float, Range(0.0, 1.0)] = 0.02

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return self.share * _scaled(problem)


@dataclass(frozen=True)
class Reckless(Parameters):
    """Does the task whatever the limits: v = J^+ V."""

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        return _least_norm(problem)


@dataclass(frozen=True)
class Jittery(Parameters):
    """Does the task and shakes: v = s J^+ V +- share v_max, the sign changing at every step.

    s <= 1 is the largest factor that keeps s J^+ V inside the velocity limits. A shaking law cannot
    be repeatable: it keeps the sign of its last step.

    Attributes:
        share: amplitude over the velocity limits.
    """

    share: Annotated[float, Range(0.0, 1.0)] = 0.1
    signs: cycle[float] = field(
        default_factory=lambda: cycle((1.0, -1.0)), init=False, compare=False, repr=False
    )

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        limit = problem.limits.joint.velocity
        fastest = np.ones(problem.robot.nv) if limit is None else _finite(limit)
        return _scaled(problem) + next(self.signs) * self.share * fastest


@dataclass(frozen=True)
class Shaker(Parameters):
    """Shakes with a period of four steps: v = s J^+ V +- share v_max, two steps up and two down.

    No step of it is faster than the joints accelerate where their limits are not known.

    Attributes:
        share: amplitude over the velocity limits.
    """

    share: Annotated[float, Range(0.0, 1.0)] = 0.02
    signs: cycle[float] = field(
        default_factory=lambda: cycle((1.0, 1.0, -1.0, -1.0)), init=False, compare=False, repr=False
    )

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        limit = problem.limits.joint.velocity
        fastest = np.ones(problem.robot.nv) if limit is None else _finite(limit)
        return _scaled(problem) + next(self.signs) * self.share * fastest


STRAW_LAWS: Final = (Idle, Creeper, Reckless, Jittery, Shaker)
"""All straw laws."""


def _least_norm(problem: DikProblem) -> Array:
    task = problem.primary
    return least_norm(task.J, task.V, RANK_TOLERANCE)


def _scaled(problem: DikProblem) -> Array:
    """Scale the least-norm velocity into the velocity limits."""
    v, limit = _least_norm(problem), problem.limits.joint.velocity
    return v if limit is None else v / max(1.0, float(limit.usage(v).max()))


def _finite(limit: Interval) -> Array:
    """Return the velocity limits, 1 where a joint has none [rad/s or m/s]."""
    return np.where(np.isfinite(limit.upper), limit.upper, 1.0)
