"""The perturbation of a scenario by a seed, within declared ranges; seed 0 perturbs nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.robots.robot import Robot


@dataclass(frozen=True)
class Variation:
    """The ranges, declared by a family, within which a seed perturbs its scenarios.

    Attributes:
        start: largest displacement of each joint of the posture from which the motion is built
            [rad], of a sliding joint by its share of its range (`Robot.joint_scale`).
        direction: largest rotation of the direction of the motion [rad].
        timing: largest change of the motion's duration, as a share of it.
    """

    start: float = 0.0
    direction: float = 0.0
    timing: float = 0.0

    def drawn(self, seed: int) -> Perturbation:
        """Draw what this seed changes.

        Raises:
            DikbenchError: on a negative seed.
        """
        if seed < 0:
            raise DikbenchError(f"seed {seed} must not be negative")
        return Perturbation(self, seed)

    def __str__(self) -> str:
        """Write the ranges in words."""
        parts = [
            f"start by up to {self.start:.3g} rad per joint" if self.start else "",
            f"direction by up to {self.direction:.3g} rad" if self.direction else "",
            f"timing by up to {100 * self.timing:.3g} %" if self.timing else "",
        ]
        return ", ".join(part for part in parts if part) or "nothing"


NO_VARIATION: Final = Variation()
"""The variation of a family in which a seed changes nothing."""


@dataclass(frozen=True)
class Perturbation:
    """The perturbation by one seed; each part is drawn independently, uniform in its range.

    Attributes:
        ranges: the ranges.
        seed: 0 changes nothing.
    """

    ranges: Variation
    seed: int

    def posture(
        self,
        robot: Robot,
        q: Array,
        fixed: Sequence[int] = (),
        moving: Sequence[int] | None = None,
    ) -> Array:
        """Move joints of a configuration (nq,), not past their position limits.

        Args:
            robot: the robot.
            q: the configuration.
            fixed: joints that do not move (indices into v).
            moving: joints that do; default: those that move the task frame.
        """
        if self.seed == 0 or self.ranges.start == 0:
            return q
        step = self._random(0).uniform(-self.ranges.start, self.ranges.start, robot.nv)
        still = np.setdiff1d(np.arange(robot.nv), robot.chain if moving is None else moving)
        step[still] = 0.0
        step[list(fixed)] = 0.0
        moved: Array = pin.integrate(robot.model, q, robot.joint_scale * step)
        return robot.inside(moved)

    def rotation(self, robot: Robot) -> Array:
        """Draw a rotation (3, 3) of directions; a planar arm keeps to its plane."""
        if self.seed == 0 or self.ranges.direction == 0:
            return np.eye(3)
        random = self._random(1)
        axis = random.normal(size=3)
        angle = random.uniform(-self.ranges.direction, self.ranges.direction)
        if 2 not in robot.movable_rows:
            axis = np.array([0.0, 0.0, 1.0])
        turned: Array = pin.exp3(angle * axis / float(np.linalg.norm(axis)))
        return turned

    @cached_property
    def pace(self) -> float:
        """The factor on the motion's duration."""
        if self.seed == 0 or self.ranges.timing == 0:
            return 1.0
        return 1.0 + float(self._random(2).uniform(-self.ranges.timing, self.ranges.timing))

    def _random(self, part: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, part])
