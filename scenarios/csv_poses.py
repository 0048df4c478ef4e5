"""A user's own robot and file of target poses."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PoseFile,
    PoseTask,
    Reference,
    Robot,
    Scenario,
    Variation,
    limits_in_force,
    load_robot,
    measure_motion,
    positive,
    read_poses,
    samples,
    secondary_tasks,
    solve_placement,
    start_velocity,
    through,
)

ROBOTS = ("panda",)
"""On which the example is certified; it takes any."""

VARIATION = Variation(timing=0.1)


def csv_poses(
    robot: str = "panda",
    *,
    file: str,
    frame: str | None = None,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """Follow the target poses of a CSV file, with any robot.

    Columns t [s], x, y, z [m], qx, qy, qz, qw (a unit quaternion), in the world, a row per pose;
    between two rows the target moves along the screw from one to the other at constant speed. The
    run starts on the first pose, in the posture that is found from the robot's own start. The
    certificate states what the file asks for; it asserts that every pose can be reached and that
    the start is inside the limits. A seed changes the pace by up to 10 %.

    Provokes: what its file does

    Shows in: position_error_rms_m, velocity_peak_ratio, position_violation_max_rad

    Args:
        robot: a robot's name, or the path of a URDF.
        file: path of the CSV file.
        frame: the task frame; default: the robot's.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: the file's.
    """
    positive("csv", gain=gain, dt=dt)
    poses = read_poses(file)
    arm = limits_in_force(load_robot(robot, frame), acceleration=acceleration)
    pace = VARIATION.drawn(seed).pace
    times = [pace * t for t in poses.times]
    reference = through(times, poses.placements, smooth=False)
    instants = samples(reference.duration, dt)
    q = _followed(arm, reference, instants, poses, times, file)
    motion = measure_motion(arm, instants, q)
    certificate = Certificate(
        (
            Claim("position margin at the start [rad]", motion.margin[0], at_least=0.0),
            Claim("position margin [rad]", motion.margin.min()),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min()),
            Claim("required speed over limit", motion.speed_ratio.max()),
        )
    )
    return Scenario(
        robot=arm,
        q0=q[0],
        v0=start_velocity(arm, reference, q[0]),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=reference.duration,
        certificate=certificate,
        tasks=secondary_tasks(arm, q[0]),
        motion=motion,
        variation=VARIATION,
    )


def _followed(
    arm: Robot,
    reference: Reference,
    instants: Array,
    poses: PoseFile,
    times: list[float],
    file: str,
) -> Array:
    """Configurations (k + 1, nq) along the path, the first from the robot's own start."""
    q = [arm.q0]
    for tau in instants:
        try:
            q.append(solve_placement(arm, reference.placement(tau), q[-1]))
        except DikbenchError:
            row = min(bisect_right(times, tau), len(times) - 1)
            line = poses.lines[row if tau > 0 else 0]
            raise DikbenchError(
                f"pose file {file}, line {line}: out of reach of robot {arm.name}, the pose or the "
                f"way to it (at {tau:.3g} s)"
            ) from None
    return np.array(q[1:])
