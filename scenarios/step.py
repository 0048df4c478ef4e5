"""A step to a target far away and far turned."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot
from dikbench.scenario import (
    Case,
    Certificate,
    Claim,
    Family,
    Perturbation,
    Time,
    Variation,
    check_velocity_limits,
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
"""Directions of the displacement and of the rotation axis, in the task axes at the start; on the
screw there the arm meets neither a limit nor a singularity."""

SMALLEST_FIRST_SPEED = 0.1
"""Smallest initial speed over the limits that a step requires, per gain [1/s] and angle [rad]
(1 rad where the robot is not asked for its orientation)."""

PAIRS = 60
"""Number of pairs of a direction and an axis to try where none is known."""


@dataclass(frozen=True, kw_only=True)
class Step(Family):
    """A step to a target far away and far turned: the first commands are too fast.

    X_d = (R exp3(angle a), p + distance R d), from the first instant on, with a and d unit vectors
    in the axes of the frame, chosen for each robot such that the screw
    X exp6(s log6(X^-1 X_d)) is free: known for eight arms, for any other robot the first of a fixed
    list (of the rows that it is asked for). A formulation without limits starts at gain times the
    error. A seed moves the start by up to 0.1 rad per joint and turns a and d by up to 0.2 rad.

    Provokes: an error that requires joint speeds beyond the limits at once

    Shows in: direction_error_max_rad, velocity_violation_max_rad_s, progress_min

    Attributes:
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
        check_velocity_limits(robot, "the speed of a step")
        q0 = change.posture(robot, robot.q0)
        if self.robot in DIRECTIONS and self.as_catalogued:
            return self._case(robot, q0, change, *DIRECTIONS[self.robot])
        reason = ""
        for direction, axis in _pairs(robot):
            try:
                case = self._case(robot, q0, change, direction, axis)
                Certificate(case.claims).check(robot.name)
            except DikbenchError as error:
                reason = f"direction {direction}, axis {axis}: {error}"
                continue
            return case
        raise DikbenchError(
            f"no step of distance={self.distance:g}, angle={self.angle:g} from the start of robot "
            f"{robot.name} is free; the last one tried: {reason}"
        )

    def _case(
        self,
        robot: Robot,
        q0: Array,
        change: Perturbation,
        direction: tuple[int, ...],
        axis: tuple[int, ...],
    ) -> Case:
        """Make the step in one direction and about one axis, either of which may be zero."""
        start = placement_of(robot, q0)
        d, a = (
            change.rotation(robot) @ (np.array(vector) / max(np.linalg.norm(vector), 1.0))
            for vector in (direction, axis)
        )
        if robot.task_axes == "world":
            d, a = start.rotation.T @ d, start.rotation.T @ a
        away = start.translation + self.distance * start.rotation @ d
        target = pin.SE3(start.rotation @ pin.exp3(self.angle * a), away)
        way = motion_of_a_step(robot, q0, pin.log6(start.actInv(target)).np, self.gain)
        turned = self.angle if any(axis) else 1.0
        least = SMALLEST_FIRST_SPEED * self.gain * turned
        claims = (*step_claims(way), Claim("first speed over limit", way.speed_ratio[0], least))
        witness = from_rest_to_rest(robot, way, 0.8 * self.duration)
        return Case(target_at_rest(target, self.duration), q0, None, claims, witness=witness)


def _pairs(robot: Robot) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Yield directions and axes to try, zero where the robot is not asked for any such row."""
    asked = np.isin(np.arange(6), robot.task_rows).astype(int)
    for drawn in asked * np.random.default_rng(0).integers(-1, 2, (PAIRS, 6)):
        if drawn[:3].any() == asked[:3].any() and drawn[3:].any() == asked[3:].any():
            yield tuple(drawn[:3].tolist()), tuple(drawn[3:].tolist())
