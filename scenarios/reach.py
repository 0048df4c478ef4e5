"""A step to a target nearby, far from every limit and singularity."""

from __future__ import annotations

from math import pi

import numpy as np
import pinocchio as pin

from dikbench.scenario import (
    Certificate,
    Claim,
    PoseTask,
    Reference,
    Scenario,
    Variation,
    between,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    positive,
    secondary_tasks,
    start_velocity,
    target_at_rest,
)

ROBOTS = ("panda", "ur3", "ur5", "ur10", "xarm7", "talos", "planar3r", "planar4r")
"""On which its defaults are certified; it takes any."""

VARIATION = Variation(start=0.1, direction=pi)


def reach(
    robot: str = "panda",
    *,
    frame: str | None = None,
    distance: float = 0.1,
    angle: float = 0.3,
    gain: float = 2.0,
    dt: float = 0.01,
    duration: float = 2.5,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A step to a target nearby: the easy case.

    The target is `distance` [m] and `angle` [rad] away from the start, along the body axis
    (-1, 1, -1)/sqrt(3) and about it; for a planar arm, along (-1, 1)/sqrt(2) and clockwise. A seed
    turns the axis, and moves the start by up to 0.1 rad per joint.

    Provokes: nothing; who fails here fails everywhere

    Shows in: position_error_final_m, orientation_error_final_rad

    Args:
        robot: a robot's name, or the path of a URDF.
        frame: its task frame; default: the robot's.
        distance: of the target [m], 0.01 to 0.3.
        angle: of the target [rad], 0 to 1.5.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        duration: [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: step response; every controller's first test.
    """
    positive("reach", gain=gain, dt=dt, duration=duration)
    between("reach", "distance", distance, 0.01, 0.3)
    between("reach", "angle", angle, 0.0, 1.5)
    arm = limits_in_force(load_robot(robot, frame), acceleration=acceleration)
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, arm.q0)
    start = placement_of(arm, q0)
    axis = change.rotation(arm) @ np.array([-1.0, 1.0, -1.0])
    twist = np.zeros(6)
    rows = list(arm.task_rows)
    twist[rows] = np.concatenate([axis, axis])[rows]  # only what the arm can move
    twist[:3] *= distance / np.linalg.norm(twist[:3])
    twist[3:] *= angle / np.linalg.norm(twist[3:])
    target = start * pin.exp6(pin.Motion(twist))
    # The motion that a gain asks for: straight there, at first at gain times the distance.
    straight = Reference(
        1 / gain,
        lambda tau: start * pin.exp6(pin.Motion(gain * tau * twist)),
        lambda tau: gain * twist,
    )
    motion = oracle_motion(arm, straight, q0, np.linspace(0.0, straight.duration, 51))
    reference = target_at_rest(target, duration)
    certificate = Certificate(
        (
            Claim("smallest singular value on the way", motion.sigma_min.min(), at_least=0.03),
            Claim("position margin on the way [rad]", motion.margin.min(), at_least=0.05),
            Claim("required speed over limit", motion.speed_ratio.max(), at_most=0.9),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=start_velocity(arm, reference, q0),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0),
        variation=VARIATION,
    )
