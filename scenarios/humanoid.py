"""A humanoid that stands and draws, with tasks for feet, hand, centre of mass and posture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.problem import (
    Array,
    CentreOfMassTask,
    Drawn,
    Kinematics,
    PoseTask,
    PostureTask,
    Range,
    Robot,
    TrackingTogether,
)
from dikbench.scenario import (
    POSTURE_WEIGHT,
    Case,
    Claim,
    NamedRobotFamily,
    OracleMotion,
    Perturbation,
    Variation,
    circle,
    oracle_motion,
    placement_of,
    plane_of,
    smallest_singular_value,
    usual_claims,
)

FEET_FRAMES = ("left_sole_link", "right_sole_link")
SOLE_SIZE_M = (0.205, 0.122)
"""Length and width of a foot, from Talos' SRDF."""

FEET_GAIN_PER_STEP = 0.5
"""Share of a foot's error that is corrected per control step (stable up to a delay of two
steps)."""

FEET_WEIGHT = 100.0
"""Weight relative to the hand's, for formulations that weigh tasks: slipping feet are worse."""

CENTRE_WEIGHT = 1e-2


@dataclass(frozen=True, kw_only=True)
class Humanoid(NamedRobotFamily):
    """A humanoid on both feet draws a circle with its right hand: 36 velocities, four tasks.

    The base is free: only the two pose tasks of the feet, of the same priority as the hand's (and a
    hundred times its weight, for formulations that weigh), keep the robot in place. Below them the
    centre of mass stays as at the start, below that the posture. The hand moves on a circle upwards
    from the start, radius (sin w tau, 1 - cos w tau) in the world's y-z plane, with fixed
    orientation; w follows from the least-norm joint motion with the feet in place. A seed moves the
    joints of the arms by up to 0.1 rad and turns the plane by up to 0.2 rad.

    Provokes: feet that slip, on a robot with a free base and many more joints than tasks

    Shows in: second_task_error_rms, position_error_max_m, orientation_error_max_rad

    The second tasks are the feet and the centre of mass; `second_task_error_rms` is of both.

    Attributes:
        speed: peak of the exact joint motion over the limits.
        radius: radius of the circle.
        laps: number of laps.
        gain: gain of the tracking task and of the centre of mass.

    Source: Escande, Mansard & Wieber 2014 (humanoids as hierarchies of tasks).
    """

    robot: Literal["talos-humanoid"] = "talos-humanoid"
    acceleration: Literal[False] = False
    speed: Annotated[float, Range(0.05, 0.9), Drawn(0.1, 0.7)] = 0.3
    radius: Annotated[float, Range(0.02, 0.15, "m"), Drawn(0.05, 0.12)] = 0.1
    laps: Annotated[float, Range(1.0, 5.0)] = 2.0

    variation = Variation(start=0.1, direction=0.2)
    outruns_sampling = True

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        model = robot.model
        arms = [model.joints[k].idx_v for k, name in enumerate(model.names) if "arm" in name]
        q0 = change.posture(robot, robot.q0, moving=arms)
        feet = _feet(robot, q0, FEET_GAIN_PER_STEP / self.dt)
        tracking = PoseTask(gain=self.gain)
        together = TrackingTogether(tracking, feet)
        plane = change.rotation(robot) @ plane_of(robot)
        curve = partial(circle, placement_of(robot, q0), self.radius, plane=plane)
        lap = oracle_motion(robot, curve(1.0, 1.0), q0, np.linspace(0, 1, 101), together)
        reference = curve(lap.peak_speed_ratio / self.speed, self.laps)
        motion = self.exact_motion(robot, reference, q0, together)
        sigma, slip, room = _measured(robot, motion, together)
        claims = (
            Claim("smallest singular value of hand and feet (m, rad)", sigma, at_least=0.05),
            Claim("way that the feet move (m, rad)", slip, at_most=1e-8),
            Claim("room of the centre of mass above the feet [m]", room, at_least=0.03),
            *usual_claims(motion, speed=(0.9 * self.speed, 1.1 * self.speed), margin=0.1),
        )
        centre = pin.centerOfMass(model, robot.scratch, q0)
        others = (
            CentreOfMassTask(centre, self.gain, CENTRE_WEIGHT),
            PostureTask(target=q0, weight=POSTURE_WEIGHT, priority=3),
        )
        return Case(reference, q0, motion, claims, tracking=tracking, tasks=(*feet, *others))


def _feet(body: Robot, q0: Array, gain: float) -> tuple[PoseTask, ...]:
    """Make the tasks of feet that stay where they are at the start."""
    return tuple(
        PoseTask(placement, gain, FEET_WEIGHT, 1, foot)
        for foot, placement in zip(FEET_FRAMES, _soles(body, q0), strict=True)
    )


def _soles(body: Robot, q: Array) -> list[Any]:
    """Compute the placements of the feet (`pinocchio.SE3`)."""
    return [placement_of(replace(body, frame=foot), q) for foot in FEET_FRAMES]


def _measured(
    body: Robot, motion: OracleMotion, together: TrackingTogether
) -> tuple[float, float, float]:
    """Measure what the certificate says of the whole body, with the feet in place.

    Returns:
        The smallest singular value of the stacked Jacobian of hand and feet (m, rad); the largest
        error of the feet (m, rad); the smallest distance of the centre of mass inside the rectangle
        about the soles [m], which is aligned with the axes of the world.
    """
    soles = np.array([X.translation[:2] for X in _soles(body, motion.q[0])])
    half = np.array(SOLE_SIZE_M) / 2
    lower, upper = soles.min(axis=0) - half, soles.max(axis=0) + half
    kinematics, sigma, slip, room = Kinematics(body), [], [], []
    hand = len(body.task_rows)
    for q in motion.q:
        kinematics.update(q)
        task = together.linearize(kinematics, kinematics.placement(body.frame_id).copy())
        sigma.append(smallest_singular_value(task.J))
        slip.append(np.linalg.norm(task.error[hand:]))
        centre = kinematics.centre_of_mass()[0][:2]
        room.append(min((centre - lower).min(), (upper - centre).min()))
    return min(sigma), float(max(slip)), float(min(room))
