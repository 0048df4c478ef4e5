"""Distances from obstacles and between the robot's own links, as rows G v <= h."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.braking import viable_brake
from dikbench.robots.collision.obstacles import Obstacle
from dikbench.robots.collision.pairs import CollisionPairs
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.limits import WAY_BACK_SPEED_SHARE
from dikbench.robots.robot import Robot

SMALLEST_GRADIENT_M_RAD: Final = 1e-6
"""A pair whose distance has a smaller gradient is left out, since no joint changes it."""

BRAKING_ACCELERATION_SHARE: Final = 0.5
"""Share of the acceleration limits that a row uses to brake, since other rows brake as well."""

UNLIMITED_JOINT_SPEED: Final = 1.0
"""Speed of a joint without a velocity limit when a distance below the margin is left [rad/s,
m/s]."""


@dataclass(frozen=True)
class CollisionConstraint:
    """Keep the robot clear of obstacles and of itself.

        -g . v <= (phi - margin)/dt,   g = dphi/dq = n^T (J_b - J_a)

    for each pair of bodies, or of a body and an obstacle, whose signed distance phi [m] is below
    the influence distance (see `dikbench.robots.collision.pairs`; the bodies are those of
    `dikbench.robots.collision.bodies`). A velocity that keeps the rows keeps phi above the
    margin up to the second-order term of the step, phi(q + v dt) - phi(q) - g . v dt, which
    `remainders` measures. Below the margin the row lets the distance grow again,
    -g . v <= max((phi - margin)/dt, -rate), with rate a tenth of the speed that the velocity limits
    allow, 0.1 sum_i |g_i| vmax_i (1 rad/s for joints without a limit). Bodies so deep in an
    obstacle that their rows contradict each other make the step infeasible. Beyond the influence
    distance, or where no joint changes the distance to first order, the row constrains nothing: 0 v
    <= 1.

    Where acceleration limits are in force the row brakes as `viable_brake` does, with half of what
    they allow, 0.5 sum_i |g_i| a_i [m/s^2], and requires no larger change of g . v in this step;
    where that is too slow, or a pair gets its row too late, the distance falls below the margin.

    With more pairs than `rows` the nearest ones have the rows. The constraint is local: it stops a
    robot in front of an obstacle and does not plan a path around it.

    Attributes:
        obstacles: obstacles in the world.
        self_collision: whether the robot's bodies keep clear of each other.
        margin: distance to keep [m].
        influence: distance below which a pair has a row [m]; it must exceed the margin by as much
            as two bodies can approach in one step, or while they brake.
        rows: largest number of rows.

    Source: Faverjon & Tournassoud 1987 (velocity damper); Kanoun et al. 2011.
    """

    obstacles: Sequence[Obstacle] = ()
    self_collision: bool = True
    margin: float = 0.01
    influence: float = 0.1
    rows: int = 20

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        if not all(isinstance(obstacle, Obstacle) for obstacle in self.obstacles):
            raise DikbenchError(
                "CollisionConstraint: obstacles: expected a list of SphereObstacle, "
                "CapsuleObstacle or BoxObstacle"
            )
        if not 0 <= self.margin < self.influence < float("inf"):
            raise DikbenchError(
                f"CollisionConstraint: margin={self.margin} must be at least 0 and below "
                f"influence={self.influence}"
            )
        if self.rows < 1:
            raise DikbenchError(f"CollisionConstraint: rows={self.rows} must be at least 1")

    def pairs(self, robot: Robot) -> CollisionPairs:
        """Return the pairs of bodies and obstacles that the constraint is about.

        Raises:
            DikbenchError: if there are none.
        """
        return _pairs(self, robot)

    def linearize(
        self, kinematics: Kinematics, v_prev: Array | None, dt: float
    ) -> tuple[Array, Array]:
        """See `Constraint`.

        Raises:
            DikbenchError: if there are no pairs.
        """
        robot = kinematics.robot
        pairs = _pairs(self, robot)
        phi = pairs.distances(kinematics)
        if len(phi) > self.rows:  # in the order of the pairs, so that a pair keeps its row
            chosen = np.sort(np.argpartition(phi, self.rows)[: self.rows])
        else:
            chosen = np.arange(len(phi))
        G, h = np.zeros((len(chosen), robot.nv)), np.ones(len(chosen))
        near = np.flatnonzero(phi[chosen] < self.influence)
        if len(near):
            g = pairs.gradients(kinematics, chosen[near])
            length = np.linalg.norm(g, axis=1)
            moving = length > SMALLEST_GRADIENT_M_RAD
            near, g, length = near[moving], g[moving], length[moving]
            room = _room(robot, phi[chosen[near]] - self.margin, g, v_prev, dt)
            G[near] = -g / length[:, None]
            h[near] = room / length
        return G, h

    def distances(self, robot: Robot, q: Array) -> Array:
        """Compute the smallest distance over all pairs at configurations (n, nq), (n,) [m]."""
        pairs, kinematics = _pairs(self, robot), Kinematics(robot)
        smallest = []
        for configuration in q:
            kinematics.update(configuration)
            smallest.append(pairs.distances(kinematics).min())
        return np.array(smallest)

    def remainders(self, robot: Robot, q: Array) -> Array:
        """Compute what the linearisation leaves out of each step of a motion (n + 1, nq).

            phi(q_(k+1)) - phi(q_k) - g(q_k) . (q_(k+1) - q_k)

        for pairs that are below the influence distance at the start of the step, 0 for others. A
        motion whose steps keep the rows stays above margin + min(remainders) [m] where no
        acceleration limits soften them.

        Returns:
            (n, p) [m] for p pairs.
        """
        pairs, kinematics = _pairs(self, robot), Kinematics(robot)
        everything = np.arange(len(pairs))
        phi, predicted = [], []
        for number, configuration in enumerate(q):
            kinematics.update(configuration)
            phi.append(pairs.distances(kinematics))
            if number + 1 < len(q):
                step = pin.difference(robot.model, configuration, q[number + 1])
                predicted.append(phi[-1] + pairs.gradients(kinematics, everything) @ step)
        before, after = np.array(phi[:-1]), np.array(phi[1:])
        return np.where(before < self.influence, after - np.array(predicted), 0.0)


def _room(robot: Robot, spare: Array, g: Array, v_prev: Array | None, dt: float) -> Array:
    """Compute how fast each pair may approach, (k,) [m/s]; negative: it must part.

    Args:
        robot: the robot, with its limits.
        spare: distances less the margin, (k,) [m].
        g: gradients of the distances, (k, nv).
        v_prev: the velocity applied last, (nv,), or None.
        dt: control period [s].
    """
    room, can = spare / dt, np.abs(g)
    if room.min(initial=0.0) < 0:
        room = np.maximum(room, -WAY_BACK_SPEED_SHARE * can @ _speeds(robot))
    acceleration = robot.limits.acceleration
    if acceleration is None or v_prev is None:
        return room
    brake = BRAKING_ACCELERATION_SHARE * can @ np.minimum(acceleration.upper, -acceleration.lower)
    room = np.minimum(room, viable_brake(spare, brake, dt))
    braked: Array = np.maximum(room, -g @ v_prev - brake * dt)
    return braked


@lru_cache(maxsize=32)
def _pairs(constraint: CollisionConstraint, robot: Robot) -> CollisionPairs:
    pairs = CollisionPairs(
        robot,
        constraint.obstacles,
        constraint.margin,
        self_collision=constraint.self_collision,
    )
    if not len(pairs):
        raise DikbenchError(
            f"robot {robot.name}: a collision constraint without obstacles and without pairs of "
            "bodies that could touch"
        )
    return pairs


@lru_cache(maxsize=32)
def _speeds(robot: Robot) -> Array:
    """Return the joints' largest speeds on the way back inside, (nv,) [rad/s or m/s]."""
    limit = robot.limits.velocity
    if limit is None:
        return np.full(robot.nv, UNLIMITED_JOINT_SPEED)
    speeds = np.minimum(limit.upper, -limit.lower)
    return np.where(np.isfinite(speeds), speeds, UNLIMITED_JOINT_SPEED)
