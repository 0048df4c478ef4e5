"""A closed curve at a chosen share of the joint velocity limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Annotated, Literal

from dikbench.problem import Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Family,
    Perturbation,
    Reference,
    Variation,
    circle,
    duration_at,
    lemniscate,
    placement_of,
    plane_of,
    usual_claims,
)

CURVES: Mapping[str, Callable[..., Reference]] = MappingProxyType(
    {"circle": circle, "lemniscate": lemniscate}
)


@dataclass(frozen=True, kw_only=True)
class SpeedSweep(Family):
    """A closed curve whose exact joint motion peaks at `speed` times the velocity limits.

    A circle upwards from the start, radius (sin w tau, 1 - cos w tau), or a lemniscate through it,
    radius (sin w tau, sin(2 w tau) / 2), in the world's y-z plane (a planar arm's own), while the
    frame turns about the normal of the plane by turn sin w tau; w follows from the least-norm joint
    motion that tracks the first lap exactly. Above 1 that motion exceeds the limits (another one
    may not, where the arm has a null space). A seed moves the start by up to 0.1 rad per joint and
    turns the plane by up to 0.2 rad.

    Provokes: joint speeds beyond the limits, far from any singularity

    Shows in: progress_mean, velocity_violation_max_rad_s

    Attributes:
        path: the curve.
        speed: peak of the exact joint motion over the limits.
        radius: radius of the circle, half the width of the lemniscate.
        turn: amplitude of the rotation; at 0 the orientation is fixed.
        laps: number of laps.

    Source: Flacco, De Luca & Khatib 2015 (trajectories scaled to the limits).
    """

    path: Annotated[Literal["circle", "lemniscate"], Drawn()] = "circle"
    speed: Annotated[float, Range(0.1, 3.0), Drawn(0.3, 2.0, log=True)] = 0.7
    radius: Annotated[float, Range(0.02, 0.15, "m"), Drawn(0.05, 0.15)] = 0.1
    turn: Annotated[float, Range(0.0, 0.5, "rad"), Drawn(0.0, 0.5)] = 0.0
    laps: Annotated[float, Range(1.0, 5.0)] = 2.0

    robots = ("panda", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos")
    variation = Variation(start=0.1, direction=0.2)
    outruns_sampling = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        q0 = change.posture(robot, robot.q0)
        start, plane = placement_of(robot, q0), change.rotation(robot) @ plane_of(robot)
        curve = partial(CURVES[self.path], start, self.radius, plane=plane, turn=self.turn)
        period = duration_at(robot, curve(1.0, 1.0), q0, self.speed, self.dt)
        reference = curve(period, self.laps)
        motion = self.exact_motion(robot, reference, q0)
        speed = (0.95 * self.speed, 1.05 * self.speed)
        claims = usual_claims(motion, speed=speed, sigma_min=0.04, margin=0.02)
        return Case(reference, q0, motion, claims)
