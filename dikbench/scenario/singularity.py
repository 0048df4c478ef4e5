"""Singular postures of any arm: finding them, making them exact, distinguishing their kinds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.kinematics import Kinematics, along, moved
from dikbench.robots.robot import Robot
from dikbench.scenario.oracle import position_margin

STEP_RAD: Final = 1e-5
"""Step of central differences of the Jacobian, whose error is about its square."""

ZERO_SINGULAR_VALUE: Final = 1e-10
"""Smaller singular values (m, rad) count as zero."""

ZERO_CURVATURE: Final = 1e-6
"""Smaller curvatures (m/rad^2, rad/rad^2) count as zero."""

Kind = Literal["crossing", "fold", "saddle"]


@dataclass(frozen=True, eq=False)
class Singularity:
    """A singular posture and its effect on the motion of the task frame.

    With J = U S V^T the body Jacobian (m, rad) at q, n = u_m is the unit twist that no joint
    velocity gives, and Z spans the null space, J Z = 0. A motion along z in Z gives, to second
    order, the twist n (z^T Q z)/2 with Q_ij = n^T dJ[z_i] z_j.

    - Q = 0, a crossing: no motion in Z gives n. The arm can move through it by a joint along which
      the smallest singular value grows; passing at a distance takes speeds of 1/distance.
    - Q definite or semidefinite, a fold: the edge of what can be reached, n leads to one side only;
      approaching it takes speeds of 1/sqrt(distance).
    - Q indefinite, a saddle (only on redundant arms): n leads to both sides, with the speeds
      of a fold.

    Attributes:
        q: the posture, (nq,).
        placement: of the task frame there (`pinocchio.SE3`).
        jacobian: J, (m, nv).
        lost: n, the lost unit twist (linear; angular), (6,), its largest component negative.
        kind: `crossing`, `fold` or `saddle`.
        inward: the sign of n towards the side to which `bend` leads.
        bend: the unit joint velocity in Z along which n is made fastest, (nv,).
        curvature: |bend^T Q bend|; zero at a crossing.
        growth: one-sided derivative of the smallest singular value along each joint, (nv,).
    """

    q: Array
    placement: Any
    jacobian: Array
    lost: Array
    kind: Kind
    inward: float
    bend: Array
    curvature: float
    growth: Array

    def oriented_like(self, other: Singularity) -> Singularity:
        """Return the same singularity, `lost` and `bend` with the signs of a nearby posture.

        The signs of singular vectors are arbitrary and may change from one posture to the next.
        """
        turned = float(np.sign(self.lost @ other.lost)) or 1.0
        bent = float(np.sign(self.bend @ other.bend)) or 1.0
        return replace(
            self, lost=turned * self.lost, inward=turned * self.inward, bend=bent * self.bend
        )


def analyse(robot: Robot, q: Array) -> Singularity:
    """Determine what kind of singularity an exactly singular posture (nq,) is.

    Raises:
        DikbenchError: if the posture is not singular, or loses more than one direction.
    """
    kinematics = Kinematics(robot)
    kinematics.update(q)
    J = kinematics.task_jacobian()
    placement = kinematics.placement(robot.frame_id).copy()
    U, singular, Vt = np.linalg.svd(J)
    m = len(J)
    if singular[m - 1] > 1e3 * ZERO_SINGULAR_VALUE or singular[m - 2] < 1e-4:
        raise DikbenchError(
            f"robot {robot.name}: the posture does not lose exactly one direction, its smallest "
            f"singular values are {singular[m - 2]:.2g} and {singular[m - 1]:.2g}"
        )
    n, Z = U[:, -1], Vt[m - 1 :].T
    if n[np.argmax(np.abs(n))] > 0:
        n = -n
    derivatives = _jacobian_derivatives(robot, q)  # (nv, m, nv)
    twisting = np.einsum("i,kij->kj", n, derivatives)  # n^T dJ/dq_k, a row per joint
    along = Z.T @ twisting @ Z
    Q = (along + along.T) / 2
    curvatures, directions = np.linalg.eigh(Q)
    strongest = int(np.argmax(np.abs(curvatures)))
    kind: Kind = "saddle"
    if abs(curvatures[strongest]) < ZERO_CURVATURE:
        kind = "crossing"
    elif curvatures.min() > -ZERO_CURVATURE or curvatures.max() < ZERO_CURVATURE:
        kind = "fold"
    return Singularity(
        q=q,
        placement=placement,
        jacobian=J,
        lost=body_twist(robot, placement, n),
        kind=kind,
        inward=float(np.sign(curvatures[strongest])),
        bend=Z @ directions[:, strongest],
        curvature=float(abs(curvatures[strongest])),
        growth=np.linalg.norm(twisting @ Z, axis=1),
    )


def make_singular(robot: Robot, seed: Array, *, fixed: tuple[int, ...] = ()) -> Array:
    """Find the exactly singular posture (nq,) next to a seed (nq,), by Gauss-Newton.

    It solves J(q)^T u = 0, ||u|| = 1 for the posture and its lost twist u together, starting from
    u_m of the seed, in least-norm steps of at most 0.2 rad.

    Args:
        robot: the robot.
        seed: configuration to start from, (nq,).
        fixed: joints (indices into v) that do not move.

    Raises:
        DikbenchError: if the smallest singular value does not converge to zero.
    """
    nv, m = robot.nv, len(robot.task_rows)
    kinematics = Kinematics(robot)
    free = np.setdiff1d(robot.chain, fixed)
    q = seed
    sigma = np.inf
    for _ in range(50):
        kinematics.update(q)
        J = kinematics.task_jacobian()
        U, singular, _ = np.linalg.svd(J)
        u, sigma = U[:, -1], float(singular[m - 1])
        if sigma < ZERO_SINGULAR_VALUE:
            return q
        A = np.zeros((nv + 1, len(free) + m))
        A[:nv, : len(free)] = np.einsum("i,kij->jk", u, _jacobian_derivatives(robot, q)[free])
        A[:nv, len(free) :] = J.T
        A[nv, len(free) :] = u
        step = np.zeros(nv)
        step[free] = np.linalg.lstsq(A, np.append(-J.T @ u, 0.0), rcond=1e-9)[0][: len(free)]
        step *= min(1.0, 0.2 / max(float(np.abs(step).max()), 1e-300))
        q = pin.integrate(robot.model, q, step)
    raise DikbenchError(
        f"robot {robot.name}: no singular posture found, the smallest singular value is {sigma:.2g}"
    )


def singular_postures(robot: Robot, margin: float, attempts: int = 24) -> Iterator[Array]:
    """Yield singular postures (nq,) inside the position limits, near the robot's start first.

    Args:
        robot: the robot.
        margin: least distance to each position limit [rad].
        attempts: number of seeds, which are the same in every call: the start, then farther ones.
    """
    random = np.random.default_rng(0)
    for attempt in range(attempts):
        spread = 1.5 * attempt / attempts
        step = np.zeros(robot.nv)
        drawn = random.uniform(-spread, spread, robot.nv)
        step[robot.chain] = (robot.joint_scale * drawn)[robot.chain]
        seed = pin.integrate(robot.model, robot.q0, step)
        try:
            q = make_singular(robot, seed)
        except DikbenchError:
            continue
        if position_margin(robot, q) >= margin:
            yield q


def _jacobian_derivatives(robot: Robot, q: Array) -> Array:
    """Compute dJ/dq_k of the task Jacobian, by central differences, (nv, m, nv)."""
    chain, step = robot.chain, STEP_RAD * np.eye(robot.nv)[robot.chain]
    derivatives = np.zeros((robot.nv, len(robot.task_rows), robot.nv))
    beside = moved(robot, np.broadcast_to(q, (2 * len(chain), robot.nq)), np.vstack([step, -step]))
    ahead, behind = np.split(along(robot, beside)[0], 2)
    derivatives[chain] = (ahead - behind) / (2 * STEP_RAD)
    return derivatives


def body_twist(robot: Robot, placement: Any, task_twist: Array) -> Array:
    """Write the task rows of a twist as a body twist (6,), whose other rows are zero.

    Args:
        robot: the robot.
        placement: of the task frame (`pinocchio.SE3`).
        task_twist: the rows, in the robot's task axes, (m,).
    """
    twist = np.zeros(6)
    twist[list(robot.task_rows)] = task_twist
    if robot.task_axes == "world":
        R = placement.rotation
        twist = np.concatenate([R.T @ twist[:3], R.T @ twist[3:]])
    return twist
