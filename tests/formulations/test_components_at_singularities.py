"""Alpha scaling by components where J is exactly singular: every solver has an answer."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize
from makers.problems import equation, kinematics_at

from dikbench import Robot, Status, load_robot, solve_dik
from dikbench.arrays import Array
from dikbench.testing.states import SINGULAR
from formulations.lp_alpha import regularization_for
from formulations.lp_alpha_components import twist_from_rates

SOLVERS = ("daqp", "daqp[preset=high]", "clarabel", "piqp")
PLACES: list[tuple[str, tuple[float, ...]]] = [
    ("tiago", (0.0,) * 7),
    ("panda", SINGULAR["panda"][0]),
    ("ur5", SINGULAR["ur5"][1]),
    ("ur5", (0.0,) * 6),
]
DT = 0.01


def _most(robot: Robot, q: Array, E: Array, J: Array, twist: Array) -> tuple[float, Array]:
    """The largest sum of alpha and its v, by HiGHS, in the equations as they are written."""
    velocity = robot.limits.velocity
    to_lower, to_upper = robot.limits.at(q).to_lower, robot.limits.at(q).to_upper
    assert velocity is not None
    assert to_lower is not None
    assert to_upper is not None
    n = robot.nv
    lower, upper = (
        np.maximum(velocity.lower, -to_lower / DT),
        np.minimum(velocity.upper, to_upper / DT),
    )
    bounds = [*zip(lower, upper, strict=True), *[(0.0, 1.0)] * 6]
    A = np.hstack([J, -E @ np.diag(np.linalg.solve(E, twist))])
    cost = np.concatenate([np.zeros(n), -np.ones(6)])
    found = scipy.optimize.linprog(cost, A_eq=A, b_eq=np.zeros(6), bounds=bounds)
    assert found.status == 0
    return -float(found.fun), found.x[:n]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("name", "posture"), PLACES)
def test_every_solver_answers_and_gives_the_most(
    name: str, posture: tuple[float, ...], solver: str
) -> None:
    """The sum of alpha less its price is at least that of the linear program's best velocity."""
    robot = load_robot(name)
    position = robot.limits.position
    assert position is not None
    q = np.clip(np.array(posture), position.lower, position.upper)
    kinematics = kinematics_at(robot, q)
    J = kinematics.jacobian(robot.frame_id).copy()
    E = twist_from_rates(kinematics.placement(robot.frame_id).rotation)
    assert np.linalg.svd(J, compute_uv=False)[-1] < 1e-12
    rho = regularization_for(equation(J, np.zeros(6)), None)
    random = np.random.default_rng(0)
    for _ in range(12):
        twist = random.normal(size=6) * 0.2
        answer = solve_dik(
            robot, q, twist=twist, formulation="lp-alpha-components", solver=solver, dt=DT
        )
        assert answer.status in {Status.OK, Status.STUCK, Status.NOT_VERIFIED}
        if answer.status is Status.NOT_VERIFIED:
            continue
        most, best = _most(robot, q, E, J, twist)
        v, rates = answer.velocity, np.linalg.solve(E, twist)
        alpha = np.linalg.solve(E, J @ v) / rates
        rounding = 1e-5 / np.abs(rates)
        assert np.all((alpha >= -rounding) & (alpha <= 1 + rounding))
        price = rho / 2 * (v @ v - best @ best)
        assert alpha.sum() - price >= most - rounding.sum()
