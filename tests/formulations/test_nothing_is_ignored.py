"""What `solve_dik` is given is honoured or refused: weights, and tasks beside the main one."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pytest
from makers.problems import problem_at, task_jacobian, velocity_of

from dikbench import load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.errors import DikbenchError
from dikbench.plugins.finding import plugins
from dikbench.problem import LinearizedTask, PositionTask, PostureTask

LAWS: Final = sorted(plugins("formulation"))
PANDA: Final = load_robot("panda")
TWIST: Final = np.array([0.2, -0.1, 0.3, 0.1, 0.2, -0.1])
ELBOW: Final[dict[str, Any]] = {
    "target": np.array([0.1, 0.2, 0.3]),
    "frame": "panda_link4",
    "gain": 0.3,
}
WEIGHTS: Final = np.array([0.3, 2.0, 5.0, 0.1, 1.0, 3.0])
WEIGHS: Final = {"qp", "hqp", "lm", "lm-null-space", "pink-qp", "mink-qp"}
SEES_LOWER: Final = {
    *{"qp", "hqp", "pink-qp", "mink-qp", "sns", "sns-fast", "sns-optimal", "sns-margin"},
    *{"nullspace", "nullspace-robust", "nullspace-unprojected"},
}
SEES_POSTURES: Final = {"alpha-two-stage", "drake-system"}


def asked(name: str, factor: float = 1.0, **more: Any) -> Array:
    """Answer at the Panda's start, with a multiple of the twist."""
    return solve_dik(PANDA, PANDA.q0, formulation=name, twist=factor * TWIST, **more).velocity


@pytest.mark.parametrize("weight", [7.0, WEIGHTS], ids=["one weight", "a weight per row"])
@pytest.mark.parametrize("name", LAWS)
def test_weights_are_honoured_or_refused(name: str, weight: float | Array) -> None:
    """Who weighs gives the answer of rows scaled by the roots: with a twist beyond the limits."""
    if name not in WEIGHS:
        with pytest.raises(DikbenchError, match=r"does not look at weights.* that sees 'weights'$"):
            asked(name, weight=weight)
        return
    for factor in (1.0, 10.0):
        scale, twist = np.sqrt(weight), factor * TWIST
        J, V = (scale * task_jacobian(PANDA, PANDA.q0).T).T, scale * twist
        scaled = problem_at(PANDA, PANDA.q0, [LinearizedTask(J, V, np.zeros(6))])
        v = asked(name, factor, weight=weight)
        np.testing.assert_allclose(v, velocity_of(name, scaled), atol=1e-5)
    if np.ndim(weight):
        assert np.abs(v - asked(name, factor)).max() > 1e-3


@pytest.mark.parametrize("name", LAWS)
def test_a_second_task_of_the_first_priority_is_honoured_or_refused(name: str) -> None:
    """No answer is that to the twist alone."""
    tasks = [PositionTask(**ELBOW)]
    if name == "lp-alpha-components":
        with pytest.raises(DikbenchError, match="LpAlphaComponents: components are those of"):
            asked(name, tasks=tasks)
    else:
        assert np.abs(asked(name, tasks=tasks) - asked(name)).max() > 1e-3


@pytest.mark.parametrize("kind", ["position", "posture"])
@pytest.mark.parametrize("name", LAWS)
def test_a_lower_task_is_honoured_or_refused(name: str, kind: str) -> None:
    """Where the twist leaves a joint free; some formulations see postures alone."""
    posture = PostureTask(PANDA.q0 + np.linspace(-0.3, 0.4, 7), priority=2)
    tasks = [posture if kind == "posture" else PositionTask(**ELBOW, priority=2)]
    if name in SEES_LOWER or (kind == "posture" and name in SEES_POSTURES):
        assert np.abs(asked(name, tasks=tasks) - asked(name)).max() > 1e-4
    else:
        but = "but postures " if name in SEES_POSTURES else ""
        with pytest.raises(DikbenchError, match=f"look at tasks {but}below the first priority"):
            asked(name, tasks=tasks)


@pytest.mark.parametrize("name", ["nullspace", "sns", "drake-system", "alpha-two-stage"])
def test_weights_below_the_first_priority(name: str) -> None:
    """One weight of a whole priority has nothing to compete with; different ones are refused."""
    posture = PANDA.q0 + np.linspace(-0.3, 0.4, 7)
    one, other = (asked(name, tasks=[PostureTask(posture, weight=w)]) for w in (1.0, 1e-3))
    np.testing.assert_allclose(one, other, atol=1e-9)
    with pytest.raises(DikbenchError, match="does not look at weights"):
        asked(name, tasks=[PostureTask(posture, weight=np.linspace(1, 2, 7))])
