"""Hold still for ten seconds, where that is easy and where it is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, inf, pi
from types import MappingProxyType
from typing import Literal

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.scenario import (
    Array,
    Certificate,
    Claim,
    PoseTask,
    Robot,
    Scenario,
    Variation,
    joint_oracle,
    limits_in_force,
    load_robot,
    placement_of,
    positive,
    samples,
    secondary_tasks,
    target_at_rest,
)

Posture = Literal["start", "singular", "limit"]

VARIATION = Variation(start=0.1)

DURATION = 10.0

NEAR = 0.003
"""How far from a singularity or inside its limit a joint stands [rad]: noise makes up for it."""

STRETCHED = -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))
"""Where the Panda's elbow is [rad]: lengths of its arm, offsets of its elbow [m]."""


@dataclass(frozen=True)
class Postures:
    """Where a robot can stand.

    Attributes:
        singular: a posture next to a singularity [rad].
        fixed: the joints (indices into v) that put it there, which a seed leaves alone.
        joint: the joint that stands next to its upper limit, the others as at the start.
    """

    singular: tuple[float, ...]
    fixed: tuple[int, ...]
    joint: int


_UR = Postures((0.3, -1.2, 1.4, -1.0, NEAR, 0.2), (4,), 0)

POSTURES: Mapping[str, Postures] = MappingProxyType(
    {
        "panda": Postures((0.0, 0.3, 0.0, STRETCHED - NEAR, 0.0, 1.6, pi / 4), (2, 3, 4), 5),
        "ur3": _UR,
        "ur5": _UR,
        "ur10": _UR,
    }
)

RANGES: Mapping[Posture, tuple[tuple[float, float], tuple[float, float]]] = MappingProxyType(
    {
        "start": ((0.08, inf), (0.3, inf)),
        "singular": ((1e-4, 2e-3), (0.3, inf)),
        "limit": ((0.08, inf), (0.9 * NEAR, 1.1 * NEAR)),
    }
)
"""Of the smallest singular value (m, rad) and of the position margin [rad], by posture."""


def hold_still(
    robot: Literal["panda", "ur3", "ur5", "ur10"] = "panda",
    *,
    posture: Posture = "start",
    gain: float = 5.0,
    dt: float = 0.01,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """Hold the pose of the start for 10 s: nothing should move, and what does is the law's doing.

    At the robot's start, or with a joint 0.003 rad from a singularity (a UR's wrist, the Panda's
    elbow) or from its limit. Measured exactly, every law stands still. Noise on q
    (`ideal[noise=0.003]`) makes an error that lies in the range of J, which a singularity that is
    farther away than the noise does not magnify; one that is as near does, at second order, and a
    limit that is as near seems to be broken. A seed moves the other joints by up to 0.1 rad.

    Provokes: drift and chatter, given a plant with noise or delay

    Shows in: velocity_peak_ratio, joint_travel_rad, off_course_max_rad

    Args:
        robot: panda, ur3, ur5 or ur10.
        posture: start, singular or limit.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: by construction; why damping: Wampler 1986, Nakamura & Hanafusa 1986.
    """
    positive("hold-still", gain=gain, dt=dt)
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    q0 = _posture(arm, POSTURES[robot], posture, seed)
    motion = joint_oracle(arm, lambda tau: q0, samples(DURATION, dt, most=2))
    sigma_min, margin = RANGES[posture]
    certificate = Certificate(
        (
            Claim("smallest singular value (m, rad)", motion.sigma_min.min(), *sigma_min),
            Claim("position margin [rad]", motion.margin.min(), *margin),
        )
    )
    return Scenario(
        robot=arm,
        q0=q0,
        v0=np.zeros(arm.nv),
        reference=target_at_rest(placement_of(arm, q0), DURATION),
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=DURATION,
        certificate=certificate,
        tasks=secondary_tasks(arm, q0),
        motion=motion,
        variation=VARIATION,
    )


def _posture(arm: Robot, where: Postures, posture: Posture, seed: int) -> Array:
    change = VARIATION.drawn(seed)
    if posture == "singular":
        return change.posture(arm, np.array(where.singular), where.fixed)
    q0 = change.posture(arm, arm.q0)
    if posture == "limit":
        position = arm.limits.position
        if position is None:
            raise DikbenchError(f"scenario hold-still: robot {arm.name} has no limits")
        q0 = q0.copy()
        q0[where.joint] = position.upper[where.joint] - NEAR
    return q0
