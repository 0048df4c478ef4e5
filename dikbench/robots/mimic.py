"""Joints that follow others: the mimic elements of a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.robots.limits import Interval, JointLimits


@dataclass(frozen=True)
class UrdfJoint:
    """A moving joint of a URDF: its own limits, and how it follows another one.

        q = multiplier q_other + offset

    Attributes:
        name: its name.
        lower, upper: position limits [rad or m], infinite where it has none.
        velocity: velocity limit [rad/s or m/s], infinite where it has none.
        other: name of the joint that it follows; None where it is free.
        multiplier, offset: as in the formula.
    """

    name: str
    lower: float
    upper: float
    velocity: float
    other: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0


def followers(joints: Sequence[UrdfJoint], order: list[str]) -> list[UrdfJoint]:
    """Return the joints that follow others, such that those are free and nearer the root.

    Pinocchio wants both. Of joints that move together the one nearest the root becomes free; the
    others follow it, by the same laws as before.

    Args:
        joints: all joints.
        order: their names, from the root on.

    Raises:
        DikbenchError: if a joint follows itself, or one that does not move.
    """
    by_name = {joint.name: joint for joint in joints}
    groups: dict[str, list[tuple[UrdfJoint, float, float]]] = {}
    for joint in joints:
        multiplier, offset, at, seen = 1.0, 0.0, joint, [joint.name]
        while at.other is not None:
            offset += multiplier * at.offset
            multiplier *= at.multiplier
            if at.other not in by_name:
                raise DikbenchError(f"joint {at.name!r} mimics {at.other!r}, which does not move")
            at = by_name[at.other]
            if at.name in seen:
                raise DikbenchError(f"joint {joint.name!r} mimics itself")
            seen.append(at.name)
        groups.setdefault(at.name, []).append((joint, multiplier, offset))
    found = []
    for members in groups.values():
        first, m, o = min(members, key=lambda member: order.index(member[0].name))
        if m == 0:
            raise DikbenchError(
                f"joint {first.name!r} mimics {first.other!r}, which is farther from the root, "
                "with the multiplier 0"
            )
        # q_first = m q + o and q_joint = k q + c give q_joint = k/m q_first + c - k o/m.
        found += [
            replace(joint, other=first.name, multiplier=k / m, offset=c - k * o / m)
            for joint, k, c in members
            if joint is not first
        ]
    return found


def write_followers(
    elements: Mapping[str, ElementTree.Element], joints: Iterable[UrdfJoint]
) -> None:
    """Write how joints follow others into a URDF's elements of joints, by name."""
    for element in elements.values():
        for old in element.findall("mimic"):
            element.remove(old)
    for joint in joints:
        element, other = elements[joint.name], elements[str(joint.other)]
        if "prismatic" not in (element.get("type"), other.get("type")):
            # Both have an angle as coordinate, or (cos, sin).
            element.set("type", str(other.get("type")))
        law = {"multiplier": repr(joint.multiplier), "offset": repr(joint.offset)}
        ElementTree.SubElement(element, "mimic", {"joint": str(joint.other), **law})


def with_followers(
    limits: JointLimits, model: Any, joints: Iterable[UrdfJoint], file: str
) -> JointLimits:
    """Narrow the position and velocity limits of joints by those of the joints that follow them.

    Effort limits stay the joint's own. By the balance of power its torque is tau + m tau_f, with m
    the multiplier and tau_f the follower's: a follower with a motor of its own would widen the
    limit by |m| times its own, one that a linkage drives says nothing, and a URDF does not tell
    which it is.

    Args:
        limits: the limits of the model's free joints.
        model: the Pinocchio model.
        joints: the followers.
        file: the URDF, for errors.

    Raises:
        DikbenchError: if no angle of a joint is inside all ranges.
    """
    position, velocity = limits.position, limits.velocity
    assert position is not None
    assert velocity is not None
    lower, upper, speed = position.lower.copy(), position.upper.copy(), velocity.upper.copy()
    for joint in joints:
        if joint.multiplier == 0 or not model.existJointName(str(joint.other)):
            continue
        k = model.joints[model.getJointId(str(joint.other))].idx_v
        if limits.q_index[k] >= 0:
            ends = [(end - joint.offset) / joint.multiplier for end in (joint.lower, joint.upper)]
            lower[k], upper[k] = max(lower[k], min(ends)), min(upper[k], max(ends))
        speed[k] = min(speed[k], joint.velocity / abs(joint.multiplier))
        if lower[k] > upper[k]:
            raise DikbenchError(
                f"robot file {file}: joint {joint.name!r} follows {joint.other!r}, and no position "
                "is inside the limits of both"
            )
    return replace(limits, position=Interval(lower, upper), velocity=Interval(-speed, speed))


def coupling(model: Any) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """Return the matrix (n, nv) that adds the columns of all n joint motions to the free ones.

    None where no joint follows another.
    """
    if model.nvExtended == model.nv:
        return None
    added = np.zeros((model.nvExtended, model.nv))
    for joint in model.joints:
        for k in range(joint.nvExtended if joint.idx_v >= 0 else 0):
            added[joint.idx_vExtended + k, joint.idx_v + k] = 1.0
    return added
