"""A closed curve at a chosen share of what the joints can do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal

from dikbench.scenario import (
    Certificate,
    Claim,
    PoseTask,
    Reference,
    Scenario,
    Variation,
    between,
    circle,
    duration_at,
    lemniscate,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    plane_of,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
)

ROBOTS = ("panda", "ur5", "ur10", "xarm7", "kinova", "tiago", "talos")
"""On which its defaults are certified; it takes any."""

VARIATION = Variation(start=0.1, direction=0.2)

CURVES: Mapping[str, Callable[..., Reference]] = MappingProxyType(
    {"circle": circle, "lemniscate": lemniscate}
)


def speed_sweep(
    robot: str = "panda",
    *,
    frame: str | None = None,
    path: Literal["circle", "lemniscate"] = "circle",
    speed: float = 0.7,
    radius: float = 0.1,
    turn: float = 0.0,
    laps: float = 2.0,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A closed curve so fast that its own joint motion peaks at `speed` times the velocity limits.

    A circle upwards from the start, radius (sin w tau, 1 - cos w tau), or a lemniscate through it,
    radius (sin w tau, sin(2 w tau) / 2), in the world's y-z plane (a planar arm's own), while the
    frame turns about the normal of the plane by turn sin w tau; w follows from the least-norm joint
    motion that tracks the first lap exactly. Above 1 that motion breaks the limits (another one may
    not, where the arm has a null space). A seed moves the start by up to 0.1 rad per joint and
    turns the plane by up to 0.2 rad.

    Provokes: joint speeds beyond the limits, far from any singularity

    Shows in: progress_mean, velocity_violation_max_rad_s

    Args:
        robot: a robot's name, or the path of a URDF.
        frame: its task frame; default: the robot's.
        path: circle or lemniscate.
        speed: rho, peak of the reference's joint motion over the limits, 0.1 to 3.
        radius: of the circle, half the width of the lemniscate [m], 0.02 to 0.15.
        turn: amplitude of the rotation [rad], 0 (orientation fixed) to 0.5.
        laps: number of laps, 1 to 5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: Flacco, De Luca & Khatib 2015 (trajectories scaled to the limits).
    """
    positive("speed-sweep", gain=gain, dt=dt)
    between("speed-sweep", "laps", laps, 1.0, 5.0)
    between("speed-sweep", "speed", speed, 0.1, 3.0)
    between("speed-sweep", "radius", radius, 0.02, 0.15)
    between("speed-sweep", "turn", turn, 0.0, 0.5)
    arm = limits_in_force(load_robot(robot, frame), acceleration=acceleration)
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, arm.q0)
    start, plane = placement_of(arm, q0), change.rotation(arm) @ plane_of(arm)
    curve = CURVES[path]
    period = duration_at(arm, curve(start, radius, 1.0, 1.0, plane=plane, turn=turn), q0, speed)
    reference = curve(start, radius, period, laps, plane=plane, turn=turn)
    motion = oracle_motion(arm, reference, q0, samples(reference.duration, dt))
    certificate = Certificate(
        (
            Claim(
                "required speed over limit",
                motion.speed_ratio.max(),
                at_least=0.95 * speed,
                at_most=1.05 * speed,
            ),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.04),
            Claim("position margin [rad]", motion.margin.min(), at_least=0.02),
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
