"""Cylinders in a URDF's collision geometry, in each other and apart, against support functions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from dikbench.problem import Array, Kinematics
from dikbench.robots.collision.pairs import CollisionPairs
from dikbench.robots.loading import load_robot

RADIUS, LENGTH = 0.04, 0.3


def cylinders(folder: Path) -> str:
    """Write an arm of four joints whose first and last links are cylinders; return its path."""
    shape = f'<cylinder radius="{RADIUS}" length="{LENGTH}"/>'
    parts = ['<link name="l0"/>']
    for number, axis in enumerate(("0 0 1", "0 1 0", "1 0 0", "0 1 0"), start=1):
        body = f"<collision><geometry>{shape}</geometry></collision>" if number in (1, 4) else ""
        parts.append(
            f'<link name="l{number}">{body}</link><joint name="j{number}" type="revolute">'
            f'<parent link="l{number - 1}"/><child link="l{number}"/><axis xyz="{axis}"/>'
            '<origin xyz="0.05 0.03 0.04"/>'
            '<limit lower="-3" upper="3" velocity="1" effort="1"/></joint>'
        )
    path = folder / "cylinders.urdf"
    path.write_text(f'<robot name="cylinders">{"".join(parts)}</robot>')
    return str(path)


def gap(first: pin.SE3, second: pin.SE3, directions: Array) -> Array:
    """Compute how far two cylinders are apart along unit vectors (k, 3), negative: overlapping."""

    def support(placement: pin.SE3, along: Array) -> Array:
        local = along @ placement.rotation
        across = np.hypot(local[:, 0], local[:, 1])
        far: Array = RADIUS * across + LENGTH / 2 * np.abs(local[:, 2])
        extent: Array = far + along @ placement.translation
        return extent

    apart: Array = -support(second, -directions) - support(first, directions)
    return apart


def signed_distance(first: pin.SE3, second: pin.SE3, random: np.random.Generator) -> float:
    """Maximise the gap over all directions, which is the signed distance of convex bodies."""
    directions = random.normal(size=(4000, 3))
    best, spread = -np.inf, 0.1
    for _ in range(6):
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        gaps = gap(first, second, directions)
        best = max(best, float(gaps.max()))
        directions = directions[gaps.argmax()] + spread * random.normal(size=(1000, 3))
        spread /= 4
    return best


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_distances_and_depths_of_cylinders(tmp_path: Path) -> None:
    """Within a millimetre, however deep; there is no depth of 1e308 m."""
    robot = load_robot(cylinders(tmp_path), "l4", rows="xyz", start=[0.0, 1.5, 0.0, 1.5])
    pairs = CollisionPairs(robot, (), -1.0, self_collision=True)
    assert len(pairs) == 1
    kinematics, random = Kinematics(robot), np.random.default_rng(2)
    first, last = (robot.model.getFrameId(name) for name in ("l1", "l4"))
    found, right = [], []
    for q in random.uniform(-3, 3, (150, 4)):
        kinematics.update(q)
        found.append(float(pairs.distances(kinematics)[0]))
        placed = kinematics.placement(first).copy(), kinematics.placement(last).copy()
        right.append(signed_distance(*placed, random))
    assert sum(depth < -0.01 for depth in right) > 30
    np.testing.assert_allclose(found, right, atol=1e-3)
