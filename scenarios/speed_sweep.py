"""A circle at a chosen share of what the joints can do."""

from __future__ import annotations

from typing import Literal

import numpy as np

from dikbench.certificate import Certificate, Claim
from dikbench.oracle import oracle_motion
from dikbench.references import circle
from dikbench.robot_catalogue import load_robot
from dikbench.scenario import Scenario
from dikbench.tasks import PoseTask
from dikbench.variation import Variation
from scenarios.common import (
    between,
    limits_in_force,
    placement_of,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
)

VARIATION = Variation(start=0.1)


def speed_sweep(
    robot: Literal["panda"] = "panda",
    *,
    path: Literal["circle"] = "circle",
    speed: float = 0.7,
    radius: float = 0.1,
    laps: float = 2.0,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A circle so fast that its own joint motion peaks at `speed` times the velocity limits.

    In the world's y-z plane, upwards from the start, orientation fixed; the period follows from the
    least-norm joint motion that tracks the first lap exactly. Above 1 that motion breaks the limits
    (another one may not: the arm has a null space). A seed moves the start by up to 0.1 rad per
    joint.

    Provokes: joint speeds beyond the limits, far from any singularity

    Shows in: progress_mean, velocity_violation_max_rad_s

    Args:
        robot: panda.
        path: circle.
        speed: rho, peak of the reference's joint motion over the limits, 0.1 to 3.
        radius: [m], 0.02 to 0.15.
        laps: number of laps, 1 to 20.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: Flacco, De Luca & Khatib 2015 (trajectories scaled to the limits).
    """
    positive("speed-sweep", gain=gain, dt=dt)
    between("speed-sweep", "laps", laps, 1.0, 20.0)
    between("speed-sweep", "speed", speed, 0.1, 3.0)
    between("speed-sweep", "radius", radius, 0.02, 0.15)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    q0 = VARIATION.drawn(seed).posture(arm, arm.q0)
    start = placement_of(arm, q0)
    # One lap in one second first: joint speeds scale with 1/period.
    at_one_second = oracle_motion(
        arm, circle(start, radius, 1.0, 1.0), q0, np.linspace(0.0, 1.0, 201)
    )
    period = float(at_one_second.speed_ratio.max()) / speed
    reference = circle(start, radius, period, laps)
    motion = oracle_motion(arm, reference, q0, samples(reference.duration, dt))
    certificate = Certificate(
        (
            Claim(
                "required speed over limit",
                motion.speed_ratio.max(),
                at_least=0.95 * speed,
                at_most=1.05 * speed,
            ),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.05),
            Claim("position margin [rad]", motion.margin.min(), at_least=0.05),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=start_velocity(arm, reference, q0),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=reference.duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0),
        motion=motion,
        variation=VARIATION,
    )
