"""The contract of robots, as checks for the author of one.

    @pytest.mark.parametrize("check", dikbench.testing.ROBOT_CHECKS)
    def test_contract(check):
        check(MY_ROBOT)

or, without pytest, `check_robot(MY_ROBOT)`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import pinocchio as pin

from dikbench.errors import DikbenchError, in_words
from dikbench.robots.catalogue import CatalogueEntry
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import robot_of_entry
from dikbench.robots.plugged import misfit
from dikbench.robots.robot import Robot
from dikbench.testing.cannot_check import CannotCheck

POSTURES: Final = 5

STEP: Final = 1e-6
"""Step of finite differences [rad or m]."""

TOLERANCE: Final = 1e-5
"""Largest difference of a Jacobian from finite differences."""

IMMOVABLE: Final = 1e-9
"""Smallest singular value (m, rad) of rows that the joints can move, over the postures."""

RobotCheck = Callable[[CatalogueEntry], None]


def check_robot_declaration(entry: CatalogueEntry) -> None:
    """Check that the entry says what it is, and where its acceleration limits are from."""
    if wrong := misfit(entry):
        raise AssertionError(f"it {wrong}")
    for name in ("summary", "acceleration_source"):
        text = getattr(entry, name)
        if not isinstance(text, str) or not text.strip() or "\n" in text:
            raise AssertionError(f"{name} = {text!r}; valid: one line")


def check_robot_model(entry: CatalogueEntry) -> None:
    """Check that the model has the frame, and that start and acceleration limits fit it."""
    robot = _loaded(entry)
    if not len(robot.chain):
        raise AssertionError(f"no joint moves frame {robot.frame}")
    if np.shape(robot.q0) != (robot.nq,) or not np.isfinite(robot.q0).all():
        raise AssertionError(f"start {np.asarray(entry.start).tolist()} gives no configuration")
    known = robot.available_acceleration
    if known is not None and (known.shape != (robot.nv,) or not (known > 0).all()):
        raise AssertionError(f"acceleration {known.tolist()}; valid: {robot.nv} numbers above 0")


def check_robot_start(entry: CatalogueEntry) -> None:
    """Check that the start is inside the limits, and each joint has a range."""
    robot = _loaded(entry)
    limits = robot.limits
    if not np.array_equal(robot.inside(robot.q0), robot.q0):
        raise AssertionError(f"start {robot.q0.tolist()} is outside the position limits")
    for name, interval in (("position", limits.position), ("velocity", limits.velocity)):
        if interval is None:
            continue
        bad = np.flatnonzero(~(interval.lower < interval.upper))
        if len(bad):
            raise AssertionError(
                f"{name} limits of velocity {bad[0]}: from {interval.lower[bad[0]]:g} to "
                f"{interval.upper[bad[0]]:g}; valid: a range"
            )


def check_robot_rows(entry: CatalogueEntry) -> None:
    """Check that the joints can move all rows that tasks ask for together, if there are enough."""
    robot = _loaded(entry)
    rows = list(robot.task_rows)
    best = 0.0
    for q in _postures(robot):
        kinematics = Kinematics(robot)
        kinematics.update(q)
        J = kinematics.jacobian(robot.frame_id)[rows]
        if len(robot.chain) >= len(rows):
            best = max(best, float(np.linalg.svd(J, compute_uv=False)[-1]))
        else:
            best = max(best, float(np.abs(J).max()))
    if best < IMMOVABLE:
        raise AssertionError(
            f"task_rows = {tuple(rows)}: the joints cannot move all of these rows of the twist"
        )


def check_robot_jacobian(entry: CatalogueEntry) -> None:
    """Check the Jacobian of the frame against finite differences of its placement."""
    robot = _loaded(entry)
    for q in _postures(robot):
        kinematics = Kinematics(robot)
        kinematics.update(q)
        J = np.array(kinematics.jacobian(robot.frame_id))
        here = pin.SE3(kinematics.placement(robot.frame_id))
        for k in range(robot.nv):
            step = np.zeros(robot.nv)
            step[k] = STEP
            kinematics.update(pin.integrate(robot.model, q, step))
            there = kinematics.placement(robot.frame_id)
            twist = pin.log6(here.inverse() * there).vector / STEP
            if np.abs(twist - J[:, k]).max() > TOLERANCE:
                raise AssertionError(
                    f"velocity {k} moves the frame by {twist}, its Jacobian says {J[:, k]}"
                )


def check_robot_repeatable(entry: CatalogueEntry) -> None:
    """Check that a model that is built again is the same: every worker builds its own."""
    first, again = _loaded(entry), _loaded(entry)
    if first.model != again.model or not np.array_equal(first.q0, again.q0):
        raise AssertionError("built again, the model is another one")


def _loaded(entry: CatalogueEntry) -> Robot:
    try:
        robot = robot_of_entry("robot", entry)
        _ = robot.chain  # which looks its frame up
        return robot
    except DikbenchError as error:
        raise CannotCheck(str(error), str(error)) from error
    except Exception as error:
        said = in_words(error)
        raise CannotCheck(f"raised {said}", said) from error


def _postures(robot: Robot) -> list[np.ndarray]:
    random = np.random.default_rng(0)
    steps = robot.joint_scale * random.uniform(-1, 1, (POSTURES, robot.nv))
    return [robot.inside(pin.integrate(robot.model, robot.q0, step)) for step in steps]


ROBOT_CHECKS: Final[tuple[RobotCheck, ...]] = (
    check_robot_declaration,
    check_robot_model,
    check_robot_start,
    check_robot_rows,
    check_robot_jacobian,
    check_robot_repeatable,
)
"""Every check of a robot: (entry) -> None."""


def check_robot(entry: CatalogueEntry) -> None:
    """Run every check; the first one that fails raises `AssertionError`."""
    for check in ROBOT_CHECKS:
        check(entry)
