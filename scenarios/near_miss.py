"""A path that passes a singularity at a chosen distance and speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan, pi
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from dikbench.array import Array
from dikbench.certificate import Certificate, Claim
from dikbench.errors import DikbenchError
from dikbench.kinematics import Kinematics
from dikbench.oracle import OracleMotion, oracle_motion, solve_placement
from dikbench.references import Reference, screw_path
from dikbench.robot import Robot
from dikbench.robot_catalogue import load_robot
from dikbench.scenario import Scenario
from dikbench.tasks import PoseTask
from dikbench.variation import Variation
from scenarios.common import (
    between,
    limits_in_force,
    positive,
    samples,
    secondary_tasks,
    start_velocity,
)

VARIATION = Variation(start=0.1)


@dataclass(frozen=True)
class Singularity:
    """A singular posture and how to pass it.

    Attributes:
        posture: q_s [rad].
        kind: `crossing`, if the arm can move through it and out on the other side, or `fold`, if
            it is the edge of the reachable space.
        joint: the joint (index into v) that leads out of it.
        fixed: the joints that make it singular, which a seed leaves alone.
        half_length: s0, half the length of the path [rad of that joint; m for a fold].
    """

    posture: tuple[float, ...]
    kind: Literal["crossing", "fold"]
    joint: int
    fixed: tuple[int, ...]
    half_length: float


_UR_WRIST = Singularity((0.3, -1.2, 1.4, -1.0, 0.0, 0.2), "crossing", 4, (4,), 0.3)
_PANDA_STRETCHED = -(atan(0.0825 / 0.316) + atan(0.0825 / 0.384))

SINGULARITIES: Mapping[tuple[str, str], Singularity] = MappingProxyType(
    {
        ("ur5", "wrist"): _UR_WRIST,
        ("ur10", "wrist"): _UR_WRIST,
        ("panda", "elbow"): Singularity(
            (0.0, 0.3, 0.0, _PANDA_STRETCHED, 0.0, 1.6, pi / 4), "fold", 3, (2, 3, 4), 0.15
        ),
    }
)


def near_miss(
    robot: Literal["ur5", "ur10", "panda"] = "ur5",
    *,
    singularity: Literal["wrist", "elbow"] = "wrist",
    miss: float = 0.02,
    speed: float = 0.5,
    gain: float = 5.0,
    dt: float = 0.005,
    acceleration: bool = False,
    seed: int = 0,
) -> Scenario:
    """A path that passes a singularity at the distance `miss` and the speed `speed`.

    At the singular posture q_s, X_s the placement, J = U S V^T the body Jacobian (m, rad), n = u_m
    the twist that is lost there. A crossing (a wrist) is passed along a single joint's motion d:
    X(s) = X_s exp6(miss n) exp6(s J d), s in [-s0, s0], n with its largest component negative; the
    speed that it asks for grows as speed/miss, while miss = 0 asks for the single joint's own
    speed. A fold (an elbow) is
    touched from inside: X(s) = X_s exp6((miss + |s|) n_in). A seed moves the other joints of q_s by
    up to 0.1 rad.

    Args:
        robot: ur5 and ur10 (wrist), panda (elbow).
        singularity: wrist or elbow.
        miss: length of the unit body twist n by which the path misses [m; rad]: 0 or 0.001 to 0.2
            (crossing), 0.002 to 0.1 (fold).
        speed: ds/dt [rad/s] of the joint (crossing), or along the unit twist n, mostly a
            translation [m/s] (fold); 0.02 to 3.
        gain: of the tracking task, 1/s.
        dt: control period [s].
        acceleration: whether acceleration limits are in force.
        seed: 0 perturbs nothing.

    Source: Nakamura & Hanafusa 1986; Chiaverini, Siciliano & Egeland 1994.
    """
    positive("near-miss", gain=gain, dt=dt)
    between("near-miss", "speed", speed, 0.02, 3.0)
    if (robot, singularity) not in SINGULARITIES:
        valid = ", ".join(f"robot={r},singularity={s}" for r, s in SINGULARITIES)
        raise DikbenchError(
            f"scenario near-miss: robot {robot} has no {singularity} here; valid: {valid}"
        )
    where = SINGULARITIES[robot, singularity]
    arm = limits_in_force(load_robot(robot), acceleration=acceleration)
    q_s = VARIATION.drawn(seed).posture(arm, np.array(where.posture), where.fixed)
    build = _crossing if where.kind == "crossing" else _fold
    reference, q0, motion = build(arm, where, q_s, miss, speed, dt)
    return Scenario(
        robot=arm,
        q0=q0,
        v0=start_velocity(arm, reference, q0),
        reference=reference,
        tracking=PoseTask(gain=gain),
        dt=dt,
        duration=reference.duration,
        certificate=_certificate(where, miss, speed, motion),
        tasks=secondary_tasks(arm, q0),
        motion=motion,
        variation=VARIATION,
    )


def _lost_twist(arm: Robot, q_s: Array) -> tuple[Any, Array, Array]:
    """Placement, body Jacobian (6, nv) and lost unit twist (6,) at a singular posture."""
    kinematics = Kinematics(arm)
    kinematics.update(q_s)
    J = kinematics.jacobian(arm.frame_id)
    n: Array = np.linalg.svd(J)[0][:, -1]
    if n[np.argmax(np.abs(n))] > 0:
        n = -n
    return kinematics.placement(arm.frame_id).copy(), J, n


def _crossing(
    arm: Robot, where: Singularity, q_s: Array, miss: float, speed: float, dt: float
) -> tuple[Reference, Array, OracleMotion]:
    if miss != 0:
        between("near-miss", "miss", miss, 0.001, 0.2)
    X_s, J, n = _lost_twist(arm, q_s)
    out = np.zeros(arm.nv)
    out[where.joint] = 1.0
    duration = 2 * where.half_length / speed
    middle = X_s * pin.exp6(pin.Motion(miss * n))
    reference = screw_path(middle, speed * (J @ out), duration)
    seed = pin.integrate(arm.model, q_s, -where.half_length * out)
    q0 = solve_placement(arm, reference.placement(0.0), seed)
    return reference, q0, oracle_motion(arm, reference, q0, samples(reference.duration, dt))


def _fold(
    arm: Robot, where: Singularity, q_s: Array, miss: float, speed: float, dt: float
) -> tuple[Reference, Array, OracleMotion]:
    between("near-miss", "miss", miss, 0.002, 0.1)
    X_s, _, n = _lost_twist(arm, q_s)
    bent = q_s.copy()
    bent[where.joint] -= 0.4
    half = where.half_length / speed
    for inward in (n, -n):
        try:
            q0 = solve_placement(
                arm, X_s * pin.exp6(pin.Motion((miss + where.half_length) * inward)), bent
            )
            break
        except DikbenchError:
            continue
    else:
        raise DikbenchError(f"scenario near-miss: no side of the fold of {arm.name} can be reached")

    def placement(tau: float) -> Any:
        return X_s * pin.exp6(pin.Motion((miss + speed * abs(tau - half)) * inward))

    def velocity(tau: float) -> Array:
        return (speed if tau >= half else -speed) * inward

    reference = Reference(2 * half, placement, velocity)
    return reference, q0, oracle_motion(arm, reference, q0, samples(reference.duration, dt))


def _certificate(
    where: Singularity, miss: float, speed: float, motion: OracleMotion
) -> Certificate:
    sigma = float(motion.sigma_min.min())
    claims = [
        Claim("smallest singular value on the path (m, rad)", sigma, at_most=0.15),
        Claim("its ratio to the one at the start", sigma / motion.sigma_min[0], at_most=0.7),
        Claim("position margin on the path [rad]", motion.margin.min(), at_least=0.05),
    ]
    # Near a crossing the speed grows as 1/miss, near a fold as 1/sqrt(miss); with room to spare.
    if miss > 0:
        least = 0.15 * speed / miss if where.kind == "crossing" else 0.6 * speed / np.sqrt(miss)
        claims.append(Claim("required speed over limit", motion.speed_ratio.max(), least))
    else:
        own = 0.5 * speed  # the single joint's own, over a limit of some 3 rad/s
        claims.append(Claim("required speed over limit", motion.speed_ratio.max(), at_most=own))
    return Certificate(tuple(claims))
