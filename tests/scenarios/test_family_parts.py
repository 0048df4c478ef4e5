"""Families whose parts do not fit together: each fault is named in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from dikbench.arrays import Array
from dikbench.scenario import (
    Case,
    Family,
    Kinematics,
    OrientationTask,
    Perturbation,
    PoseTask,
    PositionTask,
    PostureTask,
    Robot,
    TrackingTogether,
    joint_oracle,
    placement_of,
    through,
)
from dikbench.testing import FAMILY_CHECKS, check_family, check_family_parts
from dikbench.testing.verdicts import verdicts_on_family
from scenarios.reach import Reach
from scenarios.speed_sweep import SpeedSweep

Change = Callable[[Family, Robot, Case], Any]


def planted(change: Change, base: type[Family] = SpeedSweep, **parameters: Any) -> Family:
    """A family whose case is changed."""

    @dataclass(frozen=True, kw_only=True)
    class Planted(base):  # type: ignore[misc, valid-type]
        """A family with a fault."""

        def case(self, robot: Robot, perturbation: Perturbation) -> Any:
            """See `Family`."""
            return change(self, robot, super().case(robot, perturbation))

    return Planted(**parameters)


def elsewhere(family: Family, robot: Robot, case: Case) -> Case:
    """The reference of one frame, the robot of another."""
    return replace(case, robot=replace(robot, frame="panda_link7"))


def by_position(family: Family, robot: Robot, case: Case) -> Case:
    """A motion that follows the position alone, although the pose is tracked."""
    return replace(case, motion=family.exact_motion(robot, case.reference, case.q0, PositionTask()))


def upwards(family: Family, robot: Robot, case: Case) -> Case:
    """A path out of the plane of the arm."""
    start = placement_of(robot, case.q0)
    end = pin.SE3(start.rotation, start.translation + np.array([0.0, 0.0, 0.1]))
    reference = through([0.0, 1.0], [start, end], smooth=False)
    return replace(case, reference=reference, motion=family.exact_motion(robot, reference, case.q0))


def turned_over(family: Family, robot: Robot, case: Case) -> Case:
    """A target at rest that a planar arm would have to turn over for."""
    target = placement_of(robot, case.q0) * pin.SE3(pin.utils.rotate("x", 0.3), np.zeros(3))
    reference = replace(case.reference, placement=lambda tau: target)
    return replace(case, reference=reference, motion=None)


def stops_short(family: Family, robot: Robot, case: Case) -> Case:
    """A motion that does not get to the target at rest."""
    return replace(case, motion=joint_oracle(robot, lambda tau: case.q0, np.linspace(0.0, 2.0, 3)))


@dataclass(frozen=True)
class Impossible:
    """Asks the first joint for a speed that it cannot have."""

    def linearize(
        self, kinematics: Kinematics, v_prev: Array | None, dt: float
    ) -> tuple[Array, Array]:
        """See `Constraint`."""
        G = np.zeros((1, kinematics.robot.nv))
        G[0, 0] = 1.0
        return G, np.array([-100.0])


@dataclass(frozen=True)
class TwoErrors(PositionTask):
    """Says that it tracks three rows, and gives the errors of six."""

    def linearize(self, *given: Any) -> Any:
        """See `FrameTask`."""
        return PoseTask(gain=1.0).linearize(*given)


FAULTS: list[tuple[Family, str]] = [
    (
        planted(lambda family, robot, case: None),
        "case() returned NoneType; valid: a dikbench.scenario.Case",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, tracking=TrackingTogether(PoseTask(gain=5.0), (PostureTask(robot.q0),))
            )
        ),
        "case() returned a TrackingTogether as `tracking`; valid: a task of the task frame alone",
    ),
    (
        planted(lambda family, robot, case: replace(case, tracking=PoseTask(frame="panda_link7"))),
        "tracking follows the frame 'panda_link7', the reference is for 'panda_hand_tcp'; valid: "
        "None, 'panda_hand_tcp'",
    ),
    (planted(elsewhere), "at 0 s the exact motion leaves an error of "),
    (planted(by_position), "(m, rad) of PoseTask, which tracks; valid: at most 1e-06"),
    (
        planted(lambda family, robot, case: replace(case, q0=case.q0 + 0.01)),
        "motion.q[0] is 0.01 rad away from q0; valid: a motion that begins at q0",
    ),
    (
        planted(upwards, robot="planar3r"),
        "s the reference leaves the plane in which planar3r moves, by 0.1 (m, rad, m/s or rad/s); "
        "valid: a path in it, or another robot",
    ),
    (planted(turned_over, Reach, robot="planar3r"), "at 0 s the reference leaves the plane"),
    (planted(stops_short, Reach), "at 2 s the exact motion leaves an error of "),
    (
        planted(lambda family, robot, case: replace(case, tracking=PoseTask(priority=0))),
        "tracking.priority is 0; valid: 1 (the most important), 2, ...",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, tasks=(PostureTask(robot.q0), PostureTask(robot.q0, priority=-2))
            )
        ),
        "tasks[1].priority is -2; valid: 1 (the most important), 2, ...",
    ),
    (
        planted(lambda family, robot, case: replace(case, tracking=PoseTask(gain=-5.0))),
        "tracking.gain is -5.0; valid: finite and above 0 [1/s]",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, tasks=(PostureTask(robot.q0, gain=float("nan")),)
            )
        ),
        "tasks[0].gain is nan; valid: finite and at least 0 [1/s]",
    ),
    (
        planted(lambda family, robot, case: replace(case, tracking=TwoErrors())),
        "tracking has an error of 6 numbers; valid: 3, one for each of its rows(robot)",
    ),
    (
        planted(lambda family, robot, case: replace(case, constraints=(Impossible(),))),
        "its first control step cannot be answered: ",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, tasks=(PostureTask(robot.q0, weight=np.ones(3)),)
            )
        ),
        "its first control step cannot be answered: posture task: weight: expected a number or 7",
    ),
    (
        planted(lambda family, robot, case: replace(case, v0=np.zeros(3))),
        "v0 must be 7 finite numbers, got [0.0, 0.0, 0.0]",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, reference=replace(case.reference, velocity=lambda tau: np.zeros(3))
            ),
            Reach,
        ),
        "reference.velocity(0) has the shape (3,); valid: a body twist (6,)",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case, reference=replace(case.reference, placement=lambda tau: np.eye(4))
            ),
            Reach,
        ),
        "reference.placement(0) is of type ndarray; valid: pinocchio.SE3",
    ),
    (
        planted(
            lambda family, robot, case: replace(
                case,
                reference=replace(
                    case.reference, velocity=lambda tau: np.full(6, np.nan if tau else 0.0)
                ),
            ),
        ),
        "the reference is not finite at ",
    ),
]


@pytest.mark.parametrize(("family", "said"), FAULTS)
def test_a_fault_is_one_line_with_what_is_valid(family: Family, said: str) -> None:
    """What, for which seed, where, and what would be valid."""
    with pytest.raises(AssertionError) as caught:
        check_family_parts(family)
    message = str(caught.value)
    assert message.startswith("seed 0: ")
    assert said in message
    assert "\n" not in message
    assert len(message) < 250


@pytest.mark.parametrize(
    "change",
    [
        lambda family, robot, case: replace(
            case,
            tracking=PositionTask(),
            motion=family.exact_motion(robot, case.reference, case.q0, PositionTask()),
        ),
        lambda family, robot, case: replace(
            case,
            tracking=OrientationTask(),
            motion=family.exact_motion(robot, case.reference, case.q0, OrientationTask()),
        ),
        lambda family, robot, case: replace(case, motion=None),
        lambda family, robot, case: replace(
            case, tasks=(PostureTask(robot.q0, gain=0.0, priority=3),)
        ),
        lambda family, robot, case: replace(case, tracking=PoseTask(frame=robot.frame)),
    ],
    ids=["position", "orientation", "no motion", "gain 0", "frame named"],
)
def test_what_fits_is_kept(change: Change) -> None:
    """Each part may be another one where the others go with it."""
    check_family_parts(planted(change))


def test_the_parts_are_among_the_checks_of_a_family() -> None:
    """`check_family` and `dikbench check` ask for them."""
    assert check_family_parts in FAMILY_CHECKS
    with pytest.raises(AssertionError, match="away from q0"):
        check_family(planted(lambda family, robot, case: replace(case, q0=case.q0 + 1e-3)))
    verdicts = verdicts_on_family(planted(stops_short, Reach))
    (reason,) = (verdict.reason for verdict in verdicts if verdict.check == "parts")
    assert reason.startswith("seed 0: at 2 s the exact motion leaves an error of ")
