"""Target poses from a user's file, with any robot."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from dikbench.errors import DikbenchError
from dikbench.problem import Array, Robot
from dikbench.scenario import (
    Case,
    Claim,
    Family,
    Perturbation,
    PoseFile,
    Reference,
    Variation,
    measure_motion,
    read_poses,
    samples,
    solve_placement,
    through,
)


@dataclass(frozen=True, kw_only=True)
class CsvPoses(Family):
    """Follow the target poses of a CSV file, with any robot.

    Columns t [s], x, y, z [m], qx, qy, qz, qw (a unit quaternion), in the world, a row per pose;
    between two rows the target moves along the screw from one to the other at constant speed. The
    run starts on the first pose, in the posture found from the robot's own start. The certificate
    claims that every pose can be reached and that the start is inside the limits. A seed changes
    the pace by up to 10 %.

    Provokes: what its file does

    Shows in: position_error_rms_m, velocity_peak_ratio, position_violation_max_rad

    Attributes:
        file: path of the CSV file.

    Source: the file's.
    """

    file: str

    robots = ("panda",)
    variation = Variation(timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        poses = read_poses(self.file)
        times = [change.pace * t for t in poses.times]
        reference = through(times, poses.placements, smooth=False)
        instants = samples(reference.duration, self.dt)
        q = _followed(robot, reference, instants, poses, times, self.file)
        motion = measure_motion(robot, instants, q)
        claim = Claim("position margin at the start [rad]", motion.margin[0], at_least=0.0)
        return Case(reference, q[0], motion, (claim,))


def _followed(
    arm: Robot,
    reference: Reference,
    instants: Array,
    poses: PoseFile,
    times: list[float],
    file: str,
) -> Array:
    """Solve configurations (k + 1, nq) along the path, the first from the robot's start."""
    q = [arm.q0]
    for tau in instants:
        try:
            q.append(solve_placement(arm, reference.placement(tau), q[-1]))
        except DikbenchError:
            row = min(bisect_right(times, tau), len(times) - 1)
            line = poses.lines[row if tau > 0 else 0]
            raise DikbenchError(
                f"pose file {file}, line {line}: the pose or the path to it is out of reach of "
                f"robot {arm.name} (at {tau:.3g} s)"
            ) from None
    return np.array(q[1:])
