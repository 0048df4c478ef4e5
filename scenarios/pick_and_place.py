"""Approach, grasp, lift, carry and place an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Family,
    Perturbation,
    Reference,
    Variation,
    check_can_lift,
    duration_at,
    placement_of,
    through,
    usual_claims,
)

LEG_DURATION_SHARES = (0.2, 0.1, 0.05, 0.1, 0.3, 0.1, 0.05, 0.1)
"""Approach, down, grasp (a dwell), lift, carry, down, release (a dwell), up."""

REMEDY = "a smaller width=, height= or turn= asks for less"
"""What a user can change where the arm cannot do it."""


@dataclass(frozen=True, kw_only=True)
class PickAndPlace(Family):
    """Pick an object up on one side and place it, turned, on the other: the usual case.

    From the start to above the object, `width`/2 to the side at the same height; `height` down to
    grasp it; a dwell; up again; across by `width`; down; a dwell to release it; up. The frame is
    turned about the vertical by -turn/2 at the object and +turn/2 at its place. Every leg begins
    and ends at rest with least jerk; the duration follows from `speed`. A seed moves the start by
    up to 0.05 rad per joint and turns the direction across by up to 0.2 rad.

    Provokes: stops, dwells and starts, inside all limits up to a speed of 1

    Shows in: position_error_max_m, orientation_error_max_rad, velocity_violation_max_rad_s

    Attributes:
        width: distance from the object to its place.
        height: height by which it is lifted.
        turn: rotation of the object about the vertical.
        speed: peak of the exact joint motion over the limits.

    Source: Tedrake, Robotic Manipulation (basic pick and place); least jerk: Flash & Hogan 1985.
    """

    width: Annotated[float, Range(0.1, 0.4, "m"), Drawn(0.15, 0.35)] = 0.3
    height: Annotated[float, Range(0.02, 0.15, "m"), Drawn(0.05, 0.12)] = 0.1
    turn: Annotated[float, Range(0.0, 1.5, "rad"), Drawn(0.0, 1.0)] = 0.8
    speed: Annotated[float, Range(0.1, 3.0), Drawn(0.3, 1.2, log=True)] = 0.8

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago", "lwr", "talos")
    variation = Variation(start=0.05, direction=0.2)
    outruns_sampling = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        check_can_lift(robot, self.robots)
        q0 = change.posture(robot, robot.q0)
        places = self._places(placement_of(robot, q0), change.rotation(robot))
        try:
            duration = duration_at(robot, _path(places, 1.0), q0, self.speed, self.dt)
            reference = _path(places, duration)
            motion = self.exact_motion(robot, reference, q0)
        except DikbenchError as error:
            raise DikbenchError(f"{error} ({REMEDY})") from None
        speed = (0.95 * self.speed, 1.05 * self.speed)
        claims = usual_claims(motion, speed=speed, sigma_min=0.03, margin=0.1, remedy=REMEDY)
        return Case(reference, q0, motion, claims)

    def _places(self, start: Any, rotation: Array) -> list[Any]:
        """Compute the nine placements at the ends of the legs."""
        x, y, _ = start.translation
        across = rotation @ np.array([-y, x, 0.0])  # at a right angle to the arm
        across *= self.width / 2 / np.hypot(across[0], across[1])
        across[2] = 0.0
        down = np.array([0.0, 0.0, -self.height])

        def at(side: float, lowered: Array) -> Any:
            yaw = pin.utils.rotate("z", side * self.turn / 2)
            return pin.SE3(yaw @ start.rotation, start.translation + side * across + lowered)

        above, below = at(-1, 0 * down), at(-1, down)
        above_place, place = at(1, 0 * down), at(1, down)
        return [start, above, below, below, above, above_place, place, place, above_place]


def _path(places: list[Any], duration: float) -> Reference:
    times = duration * np.concatenate([[0.0], np.cumsum(LEG_DURATION_SHARES)])
    return through(times.tolist(), places, smooth=True)
