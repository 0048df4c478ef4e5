"""A lift of a payload that is faster than the joint torques allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Drawn, Range, Robot, TorqueConstraint
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    OracleMotion,
    Perturbation,
    Variation,
    check_can_lift,
    oracle_motion,
    placement_of,
    through,
    usual_claims,
    with_payload,
)


@dataclass(frozen=True, kw_only=True)
class TorqueLimited(Family):
    """A payload that is lifted and lowered faster than the joints' torques allow, and held between.

    Straight up by `height`, orientation fixed, from rest to rest with least jerk; a dwell; down
    again; a dwell. The payload is a ball of 5 cm radius in the hand; holding it takes `load` of a
    joint's effort limit at the worst point of the path (not the rated payload of the arm). The
    torques of the exact joint motion peak at `demand` times the limits, when it starts upwards and
    stops at the bottom. Effort limits and torque constraints are in force; friction and the motors'
    inertia are neglected. A seed moves the start by up to 0.05 rad per joint and turns the
    direction of the lift by up to 0.2 rad.

    Provokes: torques beyond the effort limits, at speeds inside the velocity limits

    Shows in: torque_usage_max, torque_violating_share, position_error_max_m, infeasible_share

    Attributes:
        height: height of the lift.
        load: largest torque over its limit while the payload is held.
        demand: largest torque of the exact joint motion over its limit.
        dwell: duration of the dwell at either end.

    Source: least jerk: Flash & Hogan 1985; torques: Featherstone 2008 (recursive Newton-Euler).
    """

    height: Annotated[float, Range(0.02, 0.3, "m"), Drawn(0.05, 0.1)] = 0.08
    load: Annotated[float, Range(0.3, 0.9), Drawn(0.7, 0.9)] = 0.85
    demand: Annotated[float, Range(1.12, 2.0), Drawn(1.12, 1.4)] = 1.15
    dwell: Annotated[float, Range(0.1, 5.0, "s"), Drawn(0.2, 1.0)] = 0.5

    robots = ("panda", "ur3", "ur5", "ur10", "xarm7", "tiago")
    variation = Variation(start=0.05, direction=0.2)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        arm = robot.with_limits(effort=robot.available_effort)
        if not np.isfinite(arm.available_effort[arm.chain]).any():
            raise DikbenchError(f"robot {arm.name}: the URDF has no effort limits")
        check_can_lift(arm, self.robots)
        q0 = change.posture(arm, arm.q0)
        bottom = placement_of(arm, q0)
        up = change.rotation(arm) @ np.array([0.0, 0.0, self.height])
        places = [bottom, pin.SE3(bottom.rotation, bottom.translation + up)]
        lift = through([0.0, 1.0], places, smooth=True)
        rise = oracle_motion(arm, lift, q0, np.linspace(0, 1, 201))
        mass = _heaviest(arm, rise.q, self.load)
        arm = with_payload(arm, mass)
        time = _shortest(arm, rise, self.demand)
        times = np.cumsum([0.0, time, self.dwell, time, self.dwell]).tolist()
        reference = through(times, [places[k] for k in (0, 1, 1, 0, 0)], smooth=True)
        motion = self.exact_motion(arm, reference, q0, most=1000)
        moving, held = _usage(arm, _torques(arm, motion)), _usage(arm, _gravity(arm, motion.q))
        claims = (
            Claim("torque of the motion over limit", moving, 1.1, 1.05 * self.demand),
            Claim("torque to hold it over limit", held, 0.95 * self.load, 1.01 * self.load),
            Claim("payload [kg]", mass, at_least=0.1),
            *usual_claims(motion, speed=(-np.inf, 1.0), sigma_min=0.03, margin=0.1),
        )
        constraints = (TorqueConstraint(),)
        return Case(
            reference, q0, motion, claims, arm, v0=np.zeros(arm.nv), constraints=constraints
        )


def _gravity(arm: Robot, q: Array) -> Array:
    """Compute the torques that hold the arm at configurations q (k, nq), (k, nv) [N m]."""
    return np.array([pin.computeGeneralizedGravity(arm.model, arm.scratch, x).copy() for x in q])


def _torques(arm: Robot, motion: OracleMotion) -> Array:
    """Compute the torques of a joint motion at its inner samples, (k - 1, nv) [N m]."""
    period, v = float(motion.instants[1] - motion.instants[0]), motion.v
    return TorqueConstraint().torques(arm, motion.q[1:-1], v[1:], v[:-1], period)


def _usage(arm: Robot, torques: Array) -> float:
    """Compute the largest torque over its limit."""
    assert arm.limits.effort is not None
    return float(arm.limits.effort.usage(torques).max())


def _heaviest(arm: Robot, q: Array, load: float) -> float:
    """Compute the payload [kg] whose holding torque peaks at `load` of a limit along q.

    Raises:
        DikbenchError: if the arm without payload needs as much.
    """
    empty = _gravity(arm, q)
    if (used := _usage(arm, empty)) >= load:
        raise DikbenchError(
            f"robot {arm.name} takes {used:.2f} of its effort limits to "
            f"hold itself; load={load} must be above that"
        )
    return _first_at(arm, load, empty, _gravity(with_payload(arm, 1.0), q) - empty)


def _shortest(arm: Robot, rise: OracleMotion, demand: float) -> float:
    """Compute the time [s] in which the torques of a one-second motion peak at `demand`.

    Torques other than gravity are proportional to 1/time^2.
    """
    holding = _gravity(arm, rise.q[1:-1])
    return 1 / float(np.sqrt(_first_at(arm, demand, holding, _torques(arm, rise) - holding)))


def _first_at(arm: Robot, share: float, torques: Array, slope: Array) -> float:
    """Compute the smallest x at which torques + x slope, (k, nv), reach `share` of a limit."""
    assert arm.limits.effort is not None
    limit = share * arm.limits.effort.upper
    with np.errstate(divide="ignore"):
        x: Array = (limit - np.sign(slope) * torques) / np.abs(slope)
    return float(x.min())
