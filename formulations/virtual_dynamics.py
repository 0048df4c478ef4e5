"""Virtual forward dynamics: a pull on the hand of an arm whose links weigh next to nothing."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import pinocchio as pin

from dikbench.errors import SolverFailed
from dikbench.problem import (
    Array,
    DikProblem,
    Drawn,
    Parameters,
    Range,
    Robot,
    Solve,
    solve_positive_definite,
)


@dataclass(frozen=True)
class VirtualDynamics(Parameters):
    """Virtual forward dynamics: the wanted motion pulls on a heavy hand at the end of light links.

        v = H^-1 J^T V,   H = J^T J + H_links(q)

    with H the joint-space inertia of an arm whose hand has the mass 1 and the inertia 1 about every
    axis, and whose links each have a point mass at the next joint and a small inertia. J (m, nv)
    and V (m,) are the primary task's, in the task frame; v in rad/s. This is damped least squares
    with the links' inertia, which depends on the configuration, in place of lambda^2 I: joints that
    move much of the arm are damped more than those near the hand. Regular wherever the links have
    mass; never exact. The source integrates from rest in every step, which is a gain on V here.
    Ignores limits and weights.

    Attributes:
        link_mass: of each link, as a share of the hand's.
        link_inertia: about every axis of each link, as a share of the hand's.

    Source: [Scherzinger2020]; the masses are those of its published code (ForwardDynamicsSolver).
    """

    link_mass: Annotated[float, Range(above=0.0), Drawn(1e-6, 0.1, log=True)] = 1e-3
    link_inertia: Annotated[float, Range(above=0.0), Drawn(1e-8, 1e-2, log=True)] = 1e-6

    def velocity(self, problem: DikProblem, solve: Solve) -> Array:
        """See `Formulation`."""
        task = problem.primary
        model, data = _light_arm(problem.robot, self.link_mass, self.link_inertia)
        H = np.triu(pin.crba(model, data, problem.q))
        H = H + np.triu(H, 1).T + task.J.T.dot(task.J)
        v = solve_positive_definite(H, task.J.T.dot(task.V))
        if v is None:
            raise SolverFailed("virtual dynamics: the inertia of the arm is singular")
        return v


@lru_cache(maxsize=32)
def _light_arm(robot: Robot, mass: float, inertia: float) -> tuple[Any, Any]:
    """Make the arm of the links alone: each has a point mass at the joint that follows it."""
    model = robot.model.copy()
    chain = list(model.supports[model.frames[robot.frame_id].parentJoint])
    ends = {joint: model.jointPlacements[after].translation for joint, after in pairwise(chain)}
    ends[chain[-1]] = model.frames[robot.frame_id].placement.translation
    for joint in range(1, model.njoints):
        at = ends.get(joint, np.zeros(3))
        about = inertia * np.eye(3)
        model.inertias[joint] = pin.Inertia(mass, np.array(at), about)
    return model, model.createData()
