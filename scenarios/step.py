"""A step to a target far away and far turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any

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
    Time,
    Variation,
    from_rest_to_rest,
    motion_of_a_step,
    placement_of,
    step_claims,
    target_at_rest,
)

DIRECTIONS: Mapping[str, tuple[tuple[int, int, int], tuple[int, int, int]]] = MappingProxyType(
    {
        "panda": ((1, -1, 0), (1, -1, 1)),
        "ur3": ((1, 0, 0), (1, -1, 1)),
        "ur5": ((0, 1, 0), (-1, -1, -1)),
        "ur10": ((1, 1, 0), (-1, -1, -1)),
        "xarm7": ((-1, 1, -1), (-1, 1, 1)),
        "kinova": ((0, -1, -1), (-1, 0, 0)),
        "tiago": ((-1, 1, 0), (1, 1, 0)),
        "talos": ((0, -1, 0), (-1, 0, -1)),
    }
)
"""Directions of the displacement and of the rotation axis, in the task frame at the start; on the
screw there the arm meets neither a limit nor a singularity."""

DIRECTIONS_DRAWN = 24
"""Number of seeded pairs of directions that are tried on a robot of a URDF."""

SMALLEST_FIRST_SPEED = 0.1
"""Smallest initial speed over the limits that a step requires, per gain [1/s] and angle [rad]."""


@dataclass(frozen=True, kw_only=True)
class Step(Family):
    """A step to a target far away and far turned: the first commands are too fast.

    X_d = (R exp3(angle a), p + distance R d), from the first instant on, with a and d unit vectors
    in the axes of the frame, chosen for each robot such that the screw
    X exp6(s log6(X^-1 X_d)) is free; for a URDF they are those of seeded pairs, and of the robots
    that are known, on whose screw it stays farthest from its limits and singularities. A
    formulation without limits starts at gain times the error. A seed moves the start by up to
    0.1 rad per joint and turns a and d by up to 0.2 rad.

    Provokes: an error that requires joint speeds beyond the limits at once

    Shows in: direction_error_max_rad, velocity_violation_max_rad_s, progress_min

    Attributes:
        robot: one of the arms in space, or a URDF.
        distance: distance of the target.
        angle: angle of the target.
        duration: duration of the run.

    Source: step response; the screw: Lynch & Park, Modern Robotics, 2017.
    """

    distance: Annotated[float, Range(0.05, 0.3, "m"), Drawn(0.1, 0.25)] = 0.2
    angle: Annotated[float, Range(0.5, 2.62, "rad"), Drawn(1.0, 2.0)] = 1.5
    duration: Time = 4.0

    robots = tuple(DIRECTIONS)
    variation = Variation(start=0.1, direction=0.2)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        if len(robot.task_rows) < 6:
            raise DikbenchError(
                f"robot {robot.name}: a step moves and turns its frame in space; valid: "
                f"{', '.join(DIRECTIONS)}, or a URDF, with all six rows"
            )
        known = DIRECTIONS.get(self.robot)
        directions = self._freest(robot) if known is None else _units(known)
        q0 = change.posture(robot, robot.q0)
        d, a = (change.rotation(robot) @ direction for direction in directions)
        target, way = self._step(robot, q0, d, a)
        claims = (*step_claims(way), self._first_speed(way))
        witness = from_rest_to_rest(robot, way, 0.8 * self.duration)
        return Case(target_at_rest(target, self.duration), q0, None, claims, witness=witness)

    def _step(self, robot: Robot, q0: Array, d: Array, a: Array) -> tuple[Any, OracleMotion]:
        """Return the target from q0 along d and turned about a, (3,) each, and the way to it."""
        start = placement_of(robot, q0)
        away = start.translation + self.distance * start.rotation @ d
        target = pin.SE3(start.rotation @ pin.exp3(self.angle * a), away)
        return target, motion_of_a_step(robot, q0, pin.log6(start.actInv(target)).np, self.gain)

    def _first_speed(self, way: OracleMotion) -> Claim:
        least = SMALLEST_FIRST_SPEED * self.gain * self.angle
        return Claim("first speed over limit", way.speed_ratio[0], least)

    def _freest(self, robot: Robot) -> tuple[Array, Array]:
        """Find the directions on whose screw a robot stays farthest from what is claimed.

        Raises:
            DikbenchError: if none can be followed.
        """
        random = np.random.default_rng(0)
        drawn = [_units(random.normal(size=(2, 3))) for _ in range(DIRECTIONS_DRAWN)]
        best, most = None, -np.inf
        for directions in (*map(_units, DIRECTIONS.values()), *drawn):
            try:
                _, way = self._step(robot, robot.q0, *directions)
            except DikbenchError:
                continue
            room = min(claim.value / claim.at_least for claim in step_claims(way))
            if self._first_speed(way).holds and room > most:
                best, most = directions, room
        if best is None:
            raise DikbenchError(
                f"robot {robot.name} (frame {robot.frame}): no step of distance={self.distance}, "
                f"angle={self.angle} can be followed; valid: shorter ones, or another robot"
            )
        return best


def _units(directions: Sequence[Sequence[float]] | Array) -> tuple[Array, Array]:
    """Scale two vectors (3,) to length 1."""
    d, a = (np.array(direction) / np.linalg.norm(direction) for direction in directions)
    return d, a
