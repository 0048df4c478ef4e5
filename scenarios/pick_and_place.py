"""Approach, grasp, lift, carry, place: what arms are bought for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PoseTask,
    Reference,
    Scenario,
    Variation,
    between,
    duration_at,
    limits_in_force,
    load_robot,
    oracle_motion,
    placement_of,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
    through,
)

ROBOTS = ("panda", "ur3", "ur5", "ur10", "xarm7", "kinova", "tiago")
"""On which its defaults are certified; it takes any that is not planar."""

VARIATION = Variation(start=0.05, direction=0.2)

SHARES = (0.2, 0.1, 0.05, 0.1, 0.3, 0.1, 0.05, 0.1)
"""Of the duration: approach, down, grasp (a dwell), lift, carry, down, release (a dwell), up."""


def pick_and_place(
    robot: str = "panda",
    *,
    frame: str | None = None,
    width: float = 0.3,
    height: float = 0.1,
    turn: float = 0.8,
    speed: float = 0.8,
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """Pick something up on one side and place it, turned, on the other; the best case in practice.

    From the start to above the object, `width`/2 to the side at the same height; `height` down to
    grasp it; a dwell; up again; across by `width`; down; a dwell to release it; up. The frame is
    turned about the vertical by -turn/2 at the object and +turn/2 where it goes. Every leg begins
    and ends at rest, in the way of least jerk; the duration follows from `speed`. A seed moves the
    start by up to 0.05 rad per joint and turns the way across by up to 0.2 rad.

    Provokes: stops, dwells and starts, inside all limits up to a speed of 1

    Shows in: position_error_max_m, orientation_error_max_rad, velocity_violation_max_rad_s

    Args:
        robot: a robot's name, or the path of a URDF.
        frame: its task frame; default: the robot's.
        width: from the object to its place [m], 0.1 to 0.4.
        height: by which it is lifted [m], 0.02 to 0.15.
        turn: of the object about the vertical [rad], 0 to 1.5.
        speed: peak of the reference's joint motion over the limits, 0.1 to 3.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: Tedrake, Robotic Manipulation (basic pick and place); least jerk: Flash & Hogan 1985.
    """
    positive("pick-and-place", gain=gain, dt=dt)
    between("pick-and-place", "width", width, 0.1, 0.4)
    between("pick-and-place", "height", height, 0.02, 0.15)
    between("pick-and-place", "turn", turn, 0.0, 1.5)
    between("pick-and-place", "speed", speed, 0.1, 3.0)
    arm = limits_in_force(load_robot(robot, frame), acceleration=acceleration)
    if 2 not in arm.task_rows:
        raise DikbenchError(
            f"scenario pick-and-place: robot {arm.name} moves in a plane and cannot lift; "
            f"valid: {', '.join(ROBOTS)}, a URDF"
        )
    change = VARIATION.drawn(seed)
    q0 = change.posture(arm, arm.q0)
    places = _places(placement_of(arm, q0), change.rotation(arm), width, height, turn)
    duration = duration_at(arm, _path(places, 1.0), q0, speed)
    reference = _path(places, duration)
    motion = oracle_motion(arm, reference, q0, samples(duration, dt))
    certificate = Certificate(
        (
            Claim(
                "required speed over limit",
                motion.speed_ratio.max(),
                at_least=0.95 * speed,
                at_most=1.05 * speed,
            ),
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), at_least=0.03),
            Claim("position margin [rad]", motion.margin.min(), at_least=0.1),
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
        motion=motion,
        variation=VARIATION,
    )


def _places(start: Any, rotation: Array, width: float, height: float, turn: float) -> list[Any]:
    """The placements between the legs, nine of them."""
    x, y, _ = start.translation
    across = rotation @ np.array([-y, x, 0.0])  # at a right angle to the arm
    across *= width / 2 / np.hypot(across[0], across[1])
    across[2] = 0.0
    down = np.array([0.0, 0.0, -height])

    def at(side: float, lowered: Array) -> Any:
        yaw = pin.utils.rotate("z", side * turn / 2)
        return pin.SE3(yaw @ start.rotation, start.translation + side * across + lowered)

    above, below = at(-1, 0 * down), at(-1, down)
    above_place, place = at(1, 0 * down), at(1, down)
    return [start, above, below, below, above, above_place, place, place, above_place]


def _path(places: list[Any], duration: float) -> Reference:
    times = duration * np.concatenate([[0.0], np.cumsum(SHARES)])
    return through(times.tolist(), places, smooth=True)
