"""Damping by the error: against damped least squares, and the Robotics Toolbox's own steps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.problems import problem_of, velocity_of

from dikbench import LinearizedTask, QuadraticProgram
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.solvers.catalogue.back_ends import parse_solver
from dikbench.solvers.checked_solve import make_solve

STEPS: list[dict[str, Any]] = json.loads(
    (Path(__file__).parents[1] / "data" / "peers" / "rtb_ik.json").read_text()
)


def answer(law: str, J: Array, V: Array, error: Array, weight: float | Array = 1.0) -> Array:
    """What a law gives for one task."""
    return velocity_of(law, problem_of(LinearizedTask(J, V, error, weight)))


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(1, 8),
    damping=st.sampled_from([0.0, 1e-3, 0.05, 1.0]),
)
@settings(deadline=None, max_examples=60)
def test_fixed_damping_is_damped_least_squares(seed: int, rows: int, damping: float) -> None:
    """With error_factor 0, bit for bit, whatever the error is."""
    random = np.random.default_rng(seed)
    J, V, error = random.normal(size=(rows, 7)), random.normal(size=rows), random.normal(size=rows)
    fixed = answer(f"lm[error_factor=0,damping={damping}]", J, V, error)
    np.testing.assert_array_equal(fixed, answer(f"dls[damping={damping}]", J, V, error))


@given(seed=st.integers(0, 2**32 - 1), rows=st.sampled_from([2, 3, 6, 7, 9]))
@settings(deadline=None, max_examples=60)
def test_normal_equations_as_they_are_published(seed: int, rows: int) -> None:
    """(J^T W J + (k E + damping^2) I)^-1 J^T W V, E = 1/2 e^T W e, also where rows are plenty."""
    random = np.random.default_rng(seed)
    J, V, error = random.normal(size=(rows, 7)), random.normal(size=rows), random.normal(size=rows)
    weight = random.uniform(0, 2, rows)
    weighted = J.T @ np.diag(weight)
    added = 0.7 * 0.5 * error @ np.diag(weight) @ error + 0.1**2
    expected = np.linalg.solve(weighted @ J + added * np.eye(7), weighted @ V)
    v = answer("lm[error_factor=0.7,damping=0.1]", J, V, error, weight)
    np.testing.assert_allclose(v, expected, rtol=0, atol=1e-11)


def test_no_error_and_no_bias_is_the_pseudo_inverse() -> None:
    """Chan & Lawrence's rule at the target itself, at full rank and without."""
    for J in (np.diag([2.0, 1.0, 0.5]), np.diag([2.0, 1.0, 0.0])):
        V = np.array([1.0, 2.0, 3.0])
        v = answer("lm[damping=0]", J, V, np.zeros(3))
        np.testing.assert_allclose(v, np.linalg.pinv(J) @ V, atol=1e-14)


RULES = {
    "chan 0.1": "lm[error_factor=0.1,damping=0]",
    "chan 1": "lm[error_factor=1,damping=0]",
    "wampler 0.0001": "lm[error_factor=0,damping=0.01]",
    "wampler 0.01": "lm[error_factor=0,damping=0.1]",
    "sugihara 0.0001": "lm[error_factor=1,damping=0.01]",
    "sugihara 0.1": f"lm[error_factor=1,damping={0.1**0.5!r}]",
}


@pytest.mark.parametrize("record", STEPS, ids=lambda record: record["id"])
@pytest.mark.parametrize("rule", RULES)
def test_steps_of_the_robotics_toolbox(rule: str, record: dict[str, Any]) -> None:
    """Its three rules are two numbers of ours; its displacements are velocities for V = e."""
    J, e = np.array(record["J"]), np.array(record["e"])
    v = answer(RULES[rule], J, e, e, np.array(record["weight"]))
    np.testing.assert_allclose(v, record["steps"][rule], rtol=0, atol=1e-11)


def test_the_default_is_sugiharas_rule() -> None:
    """With the bias of 1e-4."""
    assert make_formulation("lm") == make_formulation(RULES["sugihara 0.0001"])


def _qp_with_slack(J: Array, e: Array) -> Array:
    """The toolbox's program min 1/2 (kj |v|^2 + ks/|e|_1 |d|^2), J v + d = e, by daqp."""
    m, n = J.shape
    kj, ks = 0.01, 1.0
    P = np.diag([kj] * n + [ks / float(np.abs(e).sum())] * m)
    program = QuadraticProgram(P, np.zeros(n + m), A=np.hstack([J, np.eye(m)]), b=e)
    solve = make_solve(parse_solver("daqp[primal_tol=1e-12,dual_tol=1e-12]"), "qp")
    return solve(program)[:n]


@pytest.mark.parametrize("record", STEPS, ids=lambda record: record["id"])
def test_quadratic_program_of_the_robotics_toolbox_is_damped_least_squares(
    record: dict[str, Any],
) -> None:
    """Without its options it is `dls` with lambda^2 = kj |e|_1 / ks: ours, its own, and solved."""
    J, e = np.array(record["J"]), np.array(record["e"])
    damping = float(np.sqrt(0.01 * np.abs(e).sum() / 1.0))
    v = answer(f"dls[damping={damping!r}]", J, e, e)
    np.testing.assert_allclose(v, record["steps"]["qp"], rtol=0, atol=1e-11)
    np.testing.assert_allclose(v, _qp_with_slack(J, e), rtol=0, atol=1e-9)
