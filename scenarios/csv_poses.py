"""Target poses from a user's file, with any robot."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError
from dikbench.problem import (
    Array,
    CollisionConstraint,
    Range,
    Robot,
    TorqueConstraint,
)
from dikbench.scenario import (
    Case,
    Claim,
    Constraint,
    Family,
    OracleMotion,
    Perturbation,
    Reference,
    Variation,
    effort_limits,
    held,
    influence_distance,
    measure_motion,
    read_obstacles,
    read_poses,
    samples,
    solve_placement,
    spline_through,
    through,
    with_payload,
)

Joined = Literal["smooth", "screw", "hold"]

JOINTS: Final[Mapping[Joined, Callable[[Sequence[float], Sequence[Any]], Reference]]] = (
    MappingProxyType(
        {"smooth": spline_through, "screw": partial(through, smooth=False), "hold": held}
    )
)

STREAMS: Final[Mapping[str, str]] = MappingProxyType(
    {"teleoperation": str(Path(__file__).parent / "streams" / "teleoperation.csv")}
)
"""Files that come with dikbench."""

MOST_SAMPLES: Final = 2000
"""The exact motion is computed at every control step, or so many of them."""

FASTEST_M_S: Final = 100.0
FASTEST_RAD_S: Final = 1000.0
"""A target that moves faster between two rows is a mistake of the file."""

LOOK_AHEAD_ROWS: Final = 4
"""So many rows are looked at where a path leaves the reach."""


@dataclass(frozen=True, kw_only=True)
class CsvPoses(Family):
    """Follow the target poses of a CSV file, with any robot.

    Columns t [s], x, y, z [m], qx, qy, qz, qw (a unit quaternion), in the world, a row per pose;
    commas, semicolons or tabs separate them, lines that begin with # are left out, and times count
    from the first row. The rows are joined `smooth` (cubic splines of position and orientation; two
    rows of one pose are a rest), by the `screw` from each to the next at constant speed, whose
    jumps no robot follows exactly, or each is on `hold` until the time of the next, without a
    velocity, as a stream of commands is (which does not wait: the reference mode is `time`). The
    run starts on the first pose, in the posture found from the robot's own start, or from `q0`. The
    certificate says what the file asks for, and at which line most: the speed of the target, joint
    speeds over their limits, and joint accelerations where limits are known, from one control step
    to the next (in runs of more than 2000 steps, over a 2000th of the run); it claims that every
    pose can be reached and that the start is inside the limits.

    Obstacles are those of a TOML file with tables [[sphere]] (centre, radius), [[capsule]] (start,
    end, radius) and [[box]] (centre, size, rotation), in metres in the world; the start is claimed
    to keep the margin from them, the exact motion may run into them; whether the arm collides with
    itself is not looked at. A payload is a ball of 5 cm radius in the hand; with one, effort limits
    and torque constraints are in force, and it is claimed that they suffice to hold it at the
    start. A seed changes the pace by up to 10 %.

    Provokes: what its file does

    Shows in: position_error_rms_m, velocity_peak_ratio, position_violation_max_rad, freeze_events

    Attributes:
        file: path of the CSV file; or `teleoperation`, a stream of 30 Hz with jitter, bursts and
            gaps that comes with dikbench (made up, by `streams/make_teleoperation.py`).
        joined: what the target does between two rows.
        q0: posture near which the start is looked for, numbers with spaces between them [rad or m].
        obstacles: path of a TOML file of obstacles.
        margin: distance to keep from them.
        payload: mass of what is carried; 0 for nothing, without torque limits.

    Source: splines: de Boor 1978; the rest is the file's.
    """

    file: str
    joined: Joined = "smooth"
    q0: str | None = None
    obstacles: str | None = None
    margin: Annotated[float, Range(0.0, 0.05, "m")] = 0.01
    payload: Annotated[float, Range(0.0, unit="kg")] = 0.0

    robots = ("panda",)
    variation = Variation(timing=0.1)

    def case(self, robot: Robot, change: Perturbation) -> Case:
        """See `Family`."""
        rows = _Rows(STREAMS.get(self.file, self.file), change.pace)
        try:
            instants = samples(rows.times[-1], self.dt, MOST_SAMPLES)
        except DikbenchError as error:
            raise DikbenchError(f"pose file {rows.file}, with t in seconds: {error}") from None
        near = robot.q0 if self.q0 is None else robot.configuration(self.q0.split(), "q0")
        asked = rows.steps() if self.joined == "hold" else rows.speeds()
        reference = JOINTS[self.joined](rows.times, rows.placements)
        motion = measure_motion(robot, instants, _followed(robot, reference, instants, near, rows))
        start = Claim("position margin at the start [rad]", motion.margin[0], at_least=0.0)
        claims = [*asked, *_asked_of_joints(robot, motion, rows), start]
        constraints: list[Constraint] = []
        if self.obstacles is not None:
            collision = CollisionConstraint(
                read_obstacles(self.obstacles),
                self_collision=False,
                margin=self.margin,
                influence=influence_distance(robot),
            )
            constraints.append(collision)
            claims += _distances(robot, motion, rows, collision)
        if self.payload > 0:
            robot = with_payload(robot.with_limits(effort=robot.available_effort), self.payload)
            constraints.append(TorqueConstraint())
            claims += [_holding(robot, motion.q[0]), _torque(robot, motion, rows)]
        return Case(
            reference,
            motion.q[0],
            motion,
            tuple(claims),
            robot=robot,
            constraints=tuple(constraints),
        )


class _Rows:
    """The rows of a pose file, at the pace of a seed.

    Attributes:
        file: path of the file.
        times: [s].
        placements: `pinocchio.SE3`.
        lines: of the file.
    """

    def __init__(self, file: str, pace: float) -> None:
        poses = read_poses(file)
        self.file, self.lines, self.placements = file, poses.lines, poses.placements
        self.times = [pace * t for t in poses.times]

    def towards(self, tau: float) -> int:
        """Return the number of the row to which the target is on its way at a time [s]."""
        return min(bisect_right(self.times, tau), len(self.times) - 1) if tau > 0 else 0

    def steps(self) -> tuple[Claim, ...]:
        """Say how far the target steps at once."""
        distances, angles = self._ways()
        return (
            self._most("largest step of the target", "m", distances),
            self._most("largest turn of the target", "rad", angles),
        )

    def speeds(self) -> tuple[Claim, ...]:
        """Say how fast the target moves between rows.

        Raises:
            DikbenchError: if it is faster than anything moves; the message names the first line.
        """
        spans, (distances, angles) = np.diff(self.times), self._ways()
        for ways, most, unit in ((distances, FASTEST_M_S, "m"), (angles, FASTEST_RAD_S, "rad")):
            for k in np.flatnonzero(ways > most * spans)[:1]:
                raise DikbenchError(
                    f"pose file {self.file}, line {self.lines[k + 1]}: the target moves "
                    f"{ways[k]:.3g} {unit} within {spans[k]:.3g} s of the row before; valid: up to "
                    f"{most:g} {unit}/s, or joined=hold"
                )
        return (
            self._most("fastest target between two rows", "m/s", distances / spans),
            self._most("fastest turn between two rows", "rad/s", angles / spans),
        )

    def _most(self, what: str, unit: str, values: Array) -> Claim:
        """Say how large a value of the ways between rows (n - 1,) becomes, and where."""
        k = int(values.argmax())
        return Claim(f"{what}, at line {self.lines[k + 1]} [{unit}]", float(values[k]))

    def _ways(self) -> tuple[Array, Array]:
        """Compute distances [m] and angles [rad] from each row to the next, (n - 1,) each."""
        p = np.array([X.translation for X in self.placements])
        turns = [
            pin.log3(here.rotation.T @ there.rotation) for here, there in pairwise(self.placements)
        ]
        return np.linalg.norm(np.diff(p, axis=0), axis=1), np.linalg.norm(turns, axis=1)


def _followed(arm: Robot, reference: Reference, instants: Array, near: Array, rows: _Rows) -> Array:
    """Solve configurations (k + 1, nq) along the path, the first from a posture near it."""
    q = [near]
    for tau in instants.tolist():
        try:
            q.append(solve_placement(arm, reference.placement(tau), q[-1]))
        except DikbenchError:
            line = rows.lines[_out_of_reach(arm, q[-1], rows, rows.towards(tau))]
            raise DikbenchError(
                f"pose file {rows.file}, line {line}: the pose or the path to it is out of reach "
                f"of robot {arm.name} (at {tau:.3g} s); valid: x, y, z in metres, in the frame of "
                "the robot's base, where the arm comes"
            ) from None
    return np.array(q[1:])


def _out_of_reach(arm: Robot, q: Array, rows: _Rows, first: int) -> int:
    """Find the row for which a path from q (nq,) leaves the reach: the first of the next few.

    A spline may leave it on its way to a row before. Where all are in reach, it is the first.
    """
    for row in range(first, min(first + LOOK_AHEAD_ROWS, len(rows.times))):
        try:
            solve_placement(arm, rows.placements[row], q)
        except DikbenchError:
            return row
    return first


def _asked_of_joints(arm: Robot, motion: OracleMotion, rows: _Rows) -> tuple[Claim, ...]:
    """Say how fast the exact motion is, and how hard it accelerates where limits are known."""
    middles = (motion.instants[1:] + motion.instants[:-1]) / 2
    shares = {"joint speed over limit": (middles, motion.speed_ratio)}
    in_force, known = arm.limits.acceleration, arm.available_acceleration
    if (in_force is not None or known is not None) and len(motion.v) > 1:
        a = np.diff(motion.v, axis=0) / np.diff(middles)[:, None]
        usage = np.abs(a) / known if in_force is None else in_force.usage(a)
        shares["joint acceleration over limit"] = (motion.instants[1:-1], usage.max(axis=1))
    return tuple(
        Claim(f"required {what}, at line {rows.lines[rows.towards(times[k])]}", float(values[k]))
        for what, (times, values) in shares.items()
        for k in [int(values.argmax())]
    )


def _distances(
    arm: Robot, motion: OracleMotion, rows: _Rows, constraint: CollisionConstraint
) -> tuple[Claim, Claim]:
    """Claim that the start is clear; say how near the exact motion comes to an obstacle."""
    distances = constraint.distances(arm, motion.q)
    nearest = int(distances.argmin())
    line = rows.lines[rows.towards(motion.instants[nearest])]
    return (
        Claim("distance from obstacles at the start [m]", distances[0], constraint.margin),
        Claim(f"least distance of the exact motion, at line {line} [m]", distances[nearest]),
    )


def _holding(arm: Robot, q: Array) -> Claim:
    """Claim that the effort limits suffice to hold a configuration (nq,)."""
    limit, rest = effort_limits(arm), np.zeros((1, arm.nv))
    held = TorqueConstraint().torques(arm, q[None], rest, rest, 1.0)
    usage = float(limit.usage(held).max())
    return Claim("torque to hold the start over limit", usage, at_most=1.0)


def _torque(arm: Robot, motion: OracleMotion, rows: _Rows) -> Claim:
    """Say what torques the exact motion takes at its inner samples."""
    limit, v, period = effort_limits(arm), motion.v, float(motion.instants[1])
    torques = TorqueConstraint().torques(arm, motion.q[1:-1], v[1:], v[:-1], period)
    usage = limit.usage(torques).max(axis=1)
    line = rows.lines[rows.towards(motion.instants[1 + int(usage.argmax())])]
    return Claim(f"required torque over limit, at line {line}", float(usage.max()))
