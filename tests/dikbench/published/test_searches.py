"""Repeated searches, against a plain loop over targets, and against what was printed."""

from __future__ import annotations

from typing import Literal

import msgspec
import numpy as np
import pinocchio as pin
import pytest

from dikbench.published.experiment import load_experiment
from dikbench.published.measured import verdict
from dikbench.published.searches import Searches
from dikbench.robots.kinematics import Kinematics
from dikbench.robots.loading import load_robot

SMALL = Searches(robot="panda", seed=3, targets=12, searches=6, steps=20)
CHAN = "lm[error_factor=0.1,damping=0]"


def _plainly(rules: Searches) -> list[tuple[int, int]]:
    """Search as the notebook does, one target after another: steps and searches, (0, 0) in vain."""
    robot = load_robot(rules.robot)
    kinematics, limits = Kinematics(robot), robot.limits.position
    assert limits is not None
    random = np.random.RandomState(rules.seed)
    draw = [
        [[random.uniform(*each) for each in zip(limits.lower, limits.upper, strict=True)]
         for _ in range(count)]
        for count in (rules.targets, rules.searches)
    ]  # fmt: skip
    found = []
    for q_target in draw[0]:
        kinematics.update(np.array(q_target))
        target = kinematics.placement(robot.frame_id).copy()
        total, answer = 0, (0, 0)
        for number, start in enumerate(draw[1], start=1):
            q, arrived = np.array(start), False
            step = 0
            while step < rules.steps and not arrived:
                step += 1
                kinematics.update(q)
                X = kinematics.placement(robot.frame_id)
                W = np.kron(np.eye(2), X.rotation)
                if rules.convention == "decoupled":  # in the axes of the base, as the source
                    J = W @ kinematics.jacobian(robot.frame_id)
                    turn = pin.log3(target.rotation @ X.rotation.T)
                    e = np.concatenate([target.translation - X.translation, turn])
                else:
                    J = kinematics.jacobian(robot.frame_id)
                    e = pin.log6(X.actInv(target)).np
                E = 0.5 * e @ e
                q = q + np.linalg.solve(J.T @ J + 0.1 * E * np.eye(7), J.T @ e)
                arrived = E < rules.tolerance
            total += step
            low = -np.pi if rules.wrap == "half-turn" else limits.lower
            wrapped = (q - low) % (2 * np.pi) + low
            inside = bool(((wrapped >= limits.lower) & (wrapped <= limits.upper)).all())
            if arrived and (inside or not rules.within_limits):
                answer = (total, number)
                break
        found.append(answer)
    return found


@pytest.mark.parametrize("within_limits", [True, False])
@pytest.mark.parametrize("wrap", ["half-turn", "limits"])
@pytest.mark.parametrize("convention", ["decoupled", "log6"])
def test_many_at_once_are_as_one_after_the_other(
    within_limits: bool,
    wrap: Literal["half-turn", "limits"],
    convention: Literal["decoupled", "log6"],
) -> None:
    """Means, medians and counts of steps and searches."""
    rules = msgspec.structs.replace(
        SMALL, within_limits=within_limits, wrap=wrap, convention=convention
    )
    plain = _plainly(rules)
    reached = np.array([each for each in plain if each[1]])
    measured = {name: each.value for name, each in rules.measure(CHAN).items()}
    assert measured["mean_iterations"] == pytest.approx(reached[:, 0].mean())
    assert measured["median_iterations"] == np.median(reached[:, 0])
    assert measured["mean_searches"] == pytest.approx(reached[:, 1].mean())
    assert measured["max_searches"] == reached[:, 1].max()
    assert measured["infeasible"] == pytest.approx(100 * (1 - len(reached) / len(plain)))


def test_a_formulation_that_is_asked_alone_is_as_one_that_answers_many() -> None:
    """Damped least squares, and the program that has it as its solution."""
    rules = msgspec.structs.replace(SMALL, steered_by_limits=False, steps=60, searches=2)
    batched, alone = (rules.measure(law) for law in ("dls[damping=0.1]", "qp[damping=0.1]"))
    assert batched["mean_searches"].value > 1
    assert [each.value for each in batched.values()] == [each.value for each in alone.values()]


def test_a_search_ends_where_steps_run_away() -> None:
    """A push that grows with the square of the distance: no number is left, and no warning."""
    rules = msgspec.structs.replace(SMALL, targets=4, searches=3)
    found = rules.measure("lm-null-space[error_factor=0,damping=0,limit_gain=100]")
    assert found["infeasible"].value == 100


@pytest.mark.parametrize(
    ("experiment", "row"),
    [
        ("haviland-corke-2-panda", "LM Chan 0.1, limits ignored"),
        pytest.param("haviland-corke-2-ur5", "LM Chan 0.1", marks=pytest.mark.long),
        pytest.param("haviland-corke-2-panda", "LM Sugihara 1e-4, Σ", marks=pytest.mark.long),
    ],
)
def test_rows_that_no_rounding_decides_are_equal(experiment: str, row: str) -> None:
    """Every printed number of 10 000 searches, of both arms."""
    published = load_experiment(experiment)
    (found,) = [
        msgspec.structs.replace(each, rival="") for each in published.rows if each.name == row
    ]
    measured, _ = published.measure(found)
    assert verdict(published.statistics, found.published, measured) == "equal"
