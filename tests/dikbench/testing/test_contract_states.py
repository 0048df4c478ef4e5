"""The states of the contract suite are what their labels say."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from dikbench.robots.kinematics import Kinematics, smallest_singular_value
from dikbench.robots.loading import load_robot
from dikbench.testing.states import SINGULAR, State, states

ALL = list(states())


@pytest.mark.parametrize(
    ("name", "number"), [(name, i) for name in SINGULAR for i in range(len(SINGULAR[name]))]
)
def test_singular_configurations_are_exactly_singular(name: str, number: int) -> None:
    """At every singular configuration the task Jacobian loses a rank up to rounding."""
    robot = load_robot(name)
    kinematics = Kinematics(robot)
    kinematics.update(np.array(SINGULAR[name][number], dtype=float))
    J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
    assert smallest_singular_value(J) < 1e-12


@pytest.mark.parametrize(
    ("place", "margin"),
    [
        ("1 mrad inside a limit", 1e-3),
        ("exactly at a limit", 0.0),
        ("1 mrad outside a limit", -1e-3),
    ],
)
def test_distance_to_the_limit_is_as_labelled(place: str, margin: float) -> None:
    """States about a limit are as far inside or outside of it as their label says."""
    chosen = [state for state in ALL if place in state.label]
    assert chosen
    for state in chosen:
        limits = state.problem.limits
        assert limits.to_lower is not None
        assert limits.to_upper is not None
        nearest = np.minimum(limits.to_lower, limits.to_upper).min()
        assert nearest == pytest.approx(margin, abs=1e-12), state.label


def test_velocity_before_is_inside_the_velocity_limits() -> None:
    """No state comes from a motion that broke the velocity limits."""
    moving = [state.problem for state in ALL if state.problem.v_prev is not None]
    assert moving
    for problem in moving:
        interval = problem.limits.joint.velocity
        assert problem.v_prev is not None
        assert interval is not None
        assert np.all(problem.v_prev > interval.lower)
        assert np.all(problem.v_prev < interval.upper)


def test_every_combination_comes_up_on_every_robot() -> None:
    """Each robot sees each speed with and without limits, motion before and posture task."""
    for name in SINGULAR:
        seen = {
            (speed_of(state), tuple(word in state.label for word in ("acceler", "posture")), before)
            for state in ALL
            if state.label.startswith(name)
            for before in ("unknown", "on course", "at random")
            if f"v_prev {before}" in state.label
        }
        switches = itertools.product((True, False), repeat=2)
        wanted = set(itertools.product((0.0, 0.3, 10.0), switches, ("unknown", "at random")))
        assert wanted <= seen


def speed_of(state: State) -> float:
    """Speed of the wanted twist [m/s], to the millimetre per second."""
    linear_rows = sum(row < 3 for row in state.problem.robot.task_rows)
    return round(float(np.linalg.norm(state.problem.tasks[0].V[:linear_rows])), 3)
