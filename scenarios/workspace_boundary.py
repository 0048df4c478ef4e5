"""A straight line out of the arm's reach and back, or a target out of reach."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    OracleMotion,
    Perturbation,
    Reference,
    Variation,
    measure_motion,
    placement_of,
    position_margin,
    solve_placement,
    target_at_rest,
)

FIRST_STEP_M = 0.02
"""First step along the line, which is halved where it leads too far."""

REACH_RESOLUTION_M = 1e-4
"""Step at which the search for the reach ends."""

POSITION_MARGIN_RAD = 0.02
"""Smallest distance from a position limit up to the edge of the reach."""

MOST_STEPS = 500
"""Steps along the line, at most 10 m, after which nothing ends it."""

REMEDY = "the line is another one with another frame=, rows= or seed"
"""What a user can change where the line is not one to the edge of the reach."""

LARGEST_JOINT_STEP_RAD = 0.6
"""A solution that is farther away belongs to another branch."""


@dataclass(frozen=True, kw_only=True)
class WorkspaceBoundary(Family):
    """A straight line from the start to `extent` times the reach and back, orientation held.

    On the ray from the first joint's origin o through the start, at the distance r_0:
    p(tau) = o + (r_0 + (extent reach - r_0) sin^2(pi tau/T)) u, or, where the path is `still`, the
    farthest point from the first instant on, for 20/gain seconds. The reach is measured by
    following the ray as far as there are postures, and ends in a singularity, not at a limit. A
    seed moves the start by up to 0.1 rad per joint.

    Provokes: a target out of reach: chatter of a stretched arm, and the way back

    Shows in: sigma_min, velocity_peak_ratio, stuck_share

    Attributes:
        path: out and back, or at rest at the farthest point.
        extent: distance of the farthest point over the reach along the ray.
        speed: peak speed along the line.

    Source: Chiaverini, Siciliano & Egeland 1994 (the arm stretched at the boundary).
    """

    path: Annotated[Literal["out-and-back", "still"], Drawn()] = "out-and-back"
    extent: Annotated[float, Range(1.0, 1.5), Drawn(1.0, 1.4)] = 1.1
    speed: Annotated[float, Range(0.05, 2.0, "m/s"), Drawn(0.1, 1.0, log=True)] = 0.3

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "planar3r", "planar4r")
    variation = Variation(start=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        start = placement_of(robot, q0)
        origin = robot.shoulder
        ray = start.translation - origin
        first = float(np.linalg.norm(ray))
        ray /= first

        def at(distance: float) -> Any:
            return pin.SE3(start.rotation, origin + distance * ray)

        motion = _as_far_as_it_goes(robot, at, first, q0)
        reach = float(motion.reach[-1])
        farthest = self.extent * reach
        length = farthest - first
        if self.path == "still":
            reference, until = target_at_rest(at(farthest), 20 / self.gain), 0.0
        else:
            along = start.rotation.T @ ray
            reference = _out_and_back(at, along, first, length, self.speed)
            share = min(1.0, max(0.0, (reach - first) / length))
            until = reference.duration / pi * float(np.arcsin(np.sqrt(share)))
        asked = robot.reach_of(reference.placement(reference.duration / 2))
        sigma = motion.sigma_min
        claims = (
            Claim("reach along the line [m]", reach, at_least=1.05 * first, remedy=REMEDY),
            Claim("farthest target over the reach", asked / reach, at_least=1 - 1e-9),
            Claim("singular value at the boundary (m, rad)", sigma[-1], at_most=0.02),
            Claim("its ratio to the one at the start", sigma[-1] / sigma[0], at_most=0.1),
            Claim(
                "position margin up to there [rad]",
                motion.margin.min(),
                at_least=POSITION_MARGIN_RAD,
                remedy=REMEDY,
            ),
        )
        return Case(
            reference,
            q0,
            None,
            claims,
            followable_until=until,
            comes_back=reference.moving,
            situation="near singularities" if reference.moving else "steps",
        )


def _as_far_as_it_goes(
    arm: Robot, at: Callable[[float], Any], first: float, q0: Array
) -> OracleMotion:
    """Follow the placements at(distance) from `first` [m] on until none is reached.

    Raises:
        DikbenchError: if the line leaves a limit first, or nothing ends it.
    """
    q, distance, stride = [q0], first, FIRST_STEP_M
    while stride > REACH_RESOLUTION_M:
        try:
            further = solve_placement(arm, at(distance + stride), q[-1], iterations=30)
        except DikbenchError:
            stride /= 2
            continue
        if np.abs(pin.difference(arm.model, q[-1], further)).max() > LARGEST_JOINT_STEP_RAD:
            stride /= 2
            continue
        q.append(further)
        distance += stride
        if position_margin(arm, further) < POSITION_MARGIN_RAD:
            raise DikbenchError(
                f"along the line from its start robot {arm.name} meets a joint limit at "
                f"{distance:.3g} m, not the edge of its reach ({REMEDY})"
            )
        if len(q) > MOST_STEPS:
            raise DikbenchError(
                f"nothing ends the reach of robot {arm.name} along the line from its start: it "
                f"still follows at {distance:.3g} m ({REMEDY})"
            )
    return measure_motion(arm, np.arange(len(q), dtype=float), np.array(q))


def _out_and_back(
    at: Callable[[float], Any], direction: Array, first: float, length: float, speed: float
) -> Reference:
    """Build the line from the distance `first` [m] along `direction` by `length`, and back."""
    duration = pi * length / speed
    rate = pi / duration

    def velocity(tau: float) -> Array:
        along = length * rate * np.sin(2 * rate * tau)
        return np.concatenate([along * direction, np.zeros(3)])

    return Reference(duration, lambda tau: at(first + length * np.sin(rate * tau) ** 2), velocity)
