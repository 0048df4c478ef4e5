"""Whether the limits in force are those of the model, which a peer reads."""

from __future__ import annotations

import numpy as np

from dikbench.problem import DikProblem, Interval
from formulations.peers.models import position_limits, velocity_limits


def as_modelled(problem: DikProblem, *, velocity: bool) -> bool:
    """Say whether a peer that reads the model keeps just the limits in force.

    Args:
        problem: the problem.
        velocity: whether the peer reads velocity limits as well as position limits.
    """
    robot, force = problem.robot, problem.robot.limits
    speed = velocity_limits(robot)
    wanted = Interval(-speed, speed) if velocity else None
    return (
        (force.acceleration is None or problem.v_prev is None)
        and _same(force.position, position_limits(robot))
        and _same(force.velocity, wanted)
    )


def _same(one: Interval | None, other: Interval | None) -> bool:
    """Say whether two kinds of limits are the same; none are infinite ones."""
    if one is None or other is None:
        known = one or other
        return known is None or bool(np.isinf([known.lower, known.upper]).all())
    return np.array_equal(one.lower, other.lower) and np.array_equal(one.upper, other.upper)
