"""The laws that invert the Jacobian, against formulas in its singular values and closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from makers.problems import equation, problem_of, velocity_of

from dikbench import load_robot
from dikbench.arrays import Array
from dikbench.plugins.building import make_formulation
from dikbench.robots.kinematics import Kinematics
from dikbench.testing.states import SINGULAR

SHAPES = ((6, 7), (6, 6), (3, 3), (2, 5), (8, 5))
SPECTRA = {
    "ordinary": np.array([1.9, 1.5, 1.1, 0.8, 0.5, 0.3]),
    "one nearly lost": np.array([1.9, 1.5, 1.1, 0.8, 0.5, 0.012]),
    "two nearly lost": np.array([1.9, 1.5, 1.1, 0.8, 0.03, 0.004]),
    "one lost": np.array([1.9, 1.5, 1.1, 0.8, 0.5, 0.0]),
}


def answer(law: str, J: Array, V: Array) -> Array:
    """What a law gives for J v = V."""
    return velocity_of(law, problem_of(equation(J, V)))


def with_spectrum(
    m: int, n: int, sigma: Array, seed: int = 0
) -> tuple[Array, Array, Array, Array, Array]:
    """J = U diag(sigma) V^T (m, n) built from random orthonormal U and V, and a random V.

    Keeps the last of the singular values where there are fewer directions than values.
    """
    random = np.random.default_rng(seed)
    sigma = sigma[-min(m, n) :]
    U = np.linalg.qr(random.normal(size=(m, m)))[0][:, : len(sigma)]
    Vt = np.linalg.qr(random.normal(size=(n, n)))[0][:, : len(sigma)].T
    return (U * sigma) @ Vt, random.normal(size=m), U, sigma, Vt


def numerical(s: Array) -> Array:
    """Gains of numerical filtering with damping and threshold 0.05."""
    added = np.zeros_like(s)
    added[-1] = max(0.0, 1 - (s[-1] / 0.05) ** 2) * 0.05**2
    return s / (s**2 + added)


def isotropic(s: Array) -> Array:
    """Gains with the same damping in every direction, and 0.01 beside."""
    added = max(0.0, 1 - float(s[-1] / 0.04) ** 2) * 0.08**2
    return s / (s**2 + 0.01**2 + added)


def by_manipulability(s: Array) -> Array:
    """Gains of the damping that the product of the singular values switches on."""
    share = max(0.0, 1 - float(np.prod(s)) / 0.02)
    return s / (s**2 + 0.1**2 * share**2)


def filtered(s: Array) -> Array:
    """Gains of singular value filtering, its fraction written out."""
    return (s**2 + 8 * s + 2) / (s**3 + 8 * s**2 + 2 * s + 2 * 0.02)


def parsed(s: Array) -> Array:
    """Gains of J-PARSE with a threshold of 0.1."""
    threshold = 0.1 * s[0]
    return np.array([1 / x if x > threshold else x / threshold**2 for x in s])


GAINS: dict[str, Callable[[Array], Array]] = {
    "pinv": lambda s: np.array([1 / x if x > 1e-6 else 0.0 for x in s]),
    "tsvd": lambda s: np.array([1 / x if x > 0.01 * s[0] else 0.0 for x in s]),
    "dls[damping=0.03]": lambda s: s / (s**2 + 0.03**2),
    "lm[damping=0.03]": lambda s: s / (s**2 + 0.03**2),  # the error is zero
    "dls-manipulability[damping=0.1,threshold=0.02]": by_manipulability,
    "dls-variable": numerical,
    "dls-variable[filtering=isotropic,damping=0.08,threshold=0.04,isotropic_damping=0.01]": (
        isotropic
    ),
    "sv-filter[smallest=0.02,shape=8]": filtered,
    "jparse": parsed,
}


@pytest.mark.parametrize("shape", SHAPES, ids=str)
@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize("law", GAINS)
def test_law_is_its_gain_on_every_singular_direction(
    law: str, spectrum: str, shape: tuple[int, int]
) -> None:
    """Sum_i g(sigma_i) (u_i . V) v_i, with the decomposition from which J was built."""
    J, V, U, sigma, Vt = with_spectrum(*shape, SPECTRA[spectrum])
    gains = GAINS[law](sigma)
    if law.startswith("dls-manip") and shape[0] > shape[1]:
        gains = sigma / (sigma**2 + 0.1**2)  # det J J^T = 0
    v = answer(law, J, V)
    # What is lost to rounding is eps times the largest gain (in v_m), squared where J J^T is made.
    loss = 1e-11 if law.startswith(("dls[", "lm", "dls-m")) else 1e-13
    tolerance = loss * max(1.0, float(gains.max())) ** 2
    if spectrum == "one lost" and law.startswith("sv"):
        v = Vt[:-1].T @ (Vt[:-1] @ v)  # the last u_i and v_i are chance
        gains[-1] = 0
    np.testing.assert_allclose(v, (gains * (U.T @ V)) @ Vt, rtol=0, atol=tolerance)


@pytest.mark.parametrize("name", ["panda", "ur5", "planar3r"])
@pytest.mark.parametrize("law", ["dls-variable", "dls-variable[filtering=isotropic]", "tsvd"])
def test_switched_laws_are_the_pseudo_inverse_away_from_singularities(law: str, name: str) -> None:
    """To rounding: what they change begins at a singular value of 0.05, or 1 % of the largest."""
    for J, V in regular_states(name, 30):
        expected = np.linalg.pinv(J) @ V
        scale = float(np.abs(expected).max())
        np.testing.assert_allclose(answer(law, J, V), expected, rtol=0, atol=1e-13 * scale)


def regular_states(name: str, count: int) -> list[tuple[Array, Array]]:
    """Task Jacobians of a robot whose singular values are all above 0.06, with random twists."""
    robot, random = load_robot(name), np.random.default_rng(5)
    kinematics, found = Kinematics(robot), list[tuple[Array, Array]]()
    while len(found) < count:
        kinematics.update(robot.q0 + random.uniform(-1, 1, robot.nv))
        J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
        if np.linalg.svd(J)[1][-1] > 0.06:
            found.append((J, random.normal(size=len(J))))
    return found


# --- bounds


matrices = arrays.arrays(
    float, st.tuples(st.integers(1, 6), st.integers(1, 7)), elements=st.floats(-5, 5, width=32)
)


@pytest.mark.parametrize(
    ("law", "bound"),
    [
        ("sv-filter[smallest=0.05]", lambda largest: 1 / 0.05),
        ("jparse[threshold=0.2]", lambda largest: 1 / (0.2 * largest)),
        ("tsvd[relative_tolerance=0.2]", lambda largest: 1 / (0.2 * largest)),
        ("jacobian-transpose[rank_tolerance=0.05]", lambda largest: 1 / 0.05),
    ],
)
@given(J=matrices, data=st.data())
@settings(deadline=None, max_examples=100)
def test_gain_is_bounded_whatever_the_jacobian(
    law: str, bound: Callable[[float], float], J: Array, data: st.DataObject
) -> None:
    """|v| <= bound |V|, at any rank."""
    V = data.draw(arrays.arrays(float, len(J), elements=st.floats(-10, 10, width=32)))
    v = answer(law, J, V)
    largest = float(np.linalg.norm(J, 2))
    if largest == 0 and not law.startswith("sv"):  # nothing to be a share of
        assert not v.any()
        return
    assert np.linalg.norm(v) <= np.linalg.norm(V) * bound(largest) * (1 + 1e-9)


@pytest.mark.parametrize("name", SINGULAR)
@pytest.mark.parametrize("law", ["sv-filter", "jparse"])
def test_exact_rank_loss_is_bounded_on_robots(law: str, name: str) -> None:
    """At singular postures: 1/s_0 in the lost directions, met; 1/(gamma sigma_1), nothing there."""
    robot = load_robot(name)
    kinematics = Kinematics(robot)
    for posture in SINGULAR[name]:
        kinematics.update(np.array(posture, dtype=float))
        J = kinematics.jacobian(robot.frame_id)[list(robot.task_rows)]
        U, sigma, _ = np.linalg.svd(J)
        assert sigma[-1] < 1e-12
        speed = float(np.linalg.norm(answer(law, J, U[:, -1])))
        assert speed == pytest.approx(100.0 if law == "sv-filter" else 0.0, abs=1e-6)


def test_bound_of_jparse_is_met_at_its_threshold() -> None:
    """1/(gamma sigma_1) where sigma = gamma sigma_1, less on both sides."""
    at, below, above = (
        float(answer("jparse", np.diag([2.0, s]), np.array([0.0, 1.0]))[1])
        for s in (0.2, 0.19, 0.21)
    )
    assert at == pytest.approx(1 / 0.2, rel=1e-12)
    assert max(below, above) < at
    assert below == pytest.approx(0.19 / 0.2**2, rel=1e-12)


@given(smallest=st.floats(1e-4, 0.5), share=st.floats(0.01, 0.99), s=st.floats(0, 10))
def test_filtered_singular_values_rise(smallest: float, share: float, s: float) -> None:
    """For every shape that is allowed a larger singular value has the smaller gain."""
    shape = smallest + share * (2 / smallest - smallest)
    law = f"sv-filter[smallest={smallest!r},shape={shape!r}]"
    near, far = (answer(law, np.array([[x]]), np.ones(1))[0] for x in (s, s + 0.01))
    assert far < near <= 1 / smallest * (1 + 1e-12)


# --- the Jacobian transpose


@given(J=matrices, data=st.data())
@settings(deadline=None, max_examples=100)
def test_step_of_the_jacobian_transpose_is_optimal(J: Array, data: st.DataObject) -> None:
    """The motion is along J^T V, and what remains of the task is orthogonal to what is done."""
    V = data.draw(arrays.arrays(float, len(J), elements=st.floats(-10, 10, width=32)))
    v, g = answer("jacobian-transpose", J, V), J.T @ V
    size, gradient = float(np.linalg.norm(V)), float(np.linalg.norm(g))
    if gradient <= 2e-6 * size or size < 1e-30:
        return
    assert v @ g == pytest.approx(np.linalg.norm(v) * gradient, rel=1e-9)
    assert (J @ v) @ (V - J @ v) == pytest.approx(0, abs=1e-9 * size**2)


def test_other_steps_along_the_transpose_are_worse() -> None:
    """A tenth more or less of it leaves more of the task undone."""
    for J, V in regular_states("panda", 10):
        v = answer("jacobian-transpose", J, V)
        left, more, less = (np.linalg.norm(V - a * (J @ v)) for a in (1.0, 1.1, 0.9))
        assert left < min(more, less)


def test_jacobian_transpose_gives_up_a_lost_direction() -> None:
    """In closed form: J = diag(1, eps), V along the second axis gives 1/eps, and 0 below 1e-6."""
    V = np.array([0.0, 3.0])
    for eps in (0.1, 1e-5):
        v = answer("jacobian-transpose", np.diag([1.0, eps]), V)
        np.testing.assert_allclose(v, [0, 3 / eps], rtol=1e-12)
    for eps in (1e-7, 1e-17, 0.0):
        np.testing.assert_array_equal(
            answer("jacobian-transpose", np.diag([1.0, eps]), V), [0.0, 0.0]
        )


@pytest.mark.parametrize("scale", [1e-200, 1e-9, 1e9, 1e200])
def test_jacobian_transpose_is_linear_in_the_length_of_the_twist(scale: float) -> None:
    """Although it divides squares, which under- and overflow."""
    J, V = regular_states("ur5", 1)[0]
    np.testing.assert_allclose(
        answer("jacobian-transpose", J, scale * V) / scale,
        answer("jacobian-transpose", J, V),
        rtol=1e-12,
    )


# --- switched damping


@pytest.mark.parametrize("law", ["dls-manipulability[damping=0.1,threshold={}]", "dls-variable"])
def test_damping_sets_in_continuously(law: str) -> None:
    """Just below the threshold the law is the pseudo-inverse, up to what the distance explains."""
    for below in (1e-3, 1e-5, 1e-7, 0.0, -1e-7):
        J, V, _, sigma, _ = with_spectrum(6, 7, np.array([1.9, 1.5, 1.1, 0.8, 0.5, 0.05]))
        if law == "dls-variable":
            J, V, _, sigma, _ = with_spectrum(6, 7, np.array([*sigma[:5], 0.05 * (1 - below)]))
        selector = law.format(float(np.prod(sigma)) * (1 + below))
        away = np.abs(answer(selector, J, V) - np.linalg.pinv(J) @ V).max()
        assert away <= 1e-10 + 100 * max(0.0, below)


def test_manipulability_half_way_halves_the_damping() -> None:
    """On one row, where w is the length of J: lambda = lambda_0 (1 - w/w_0) in closed form."""
    J, V = np.array([[0.6, 0.8]]), np.array([2.0])  # w = 1
    v = answer("dls-manipulability[damping=0.5,threshold=2]", J, V)
    np.testing.assert_allclose(v, J[0] * 2 / (1 + 0.25**2), rtol=1e-14)


def test_numerical_filtering_damps_one_direction_and_beta_the_second() -> None:
    """Two directions lost, J = diag(1, s, 0): 1/s down to the rank tolerance, 0 from there."""
    V = np.ones(3)
    for s, expected in ((1e-3, 1e3), (2e-6, 5e5), (5e-7, 0.0), (0.0, 0.0)):
        v = answer("dls-variable", np.diag([1.0, s, 0.0]), V)
        np.testing.assert_allclose(v, [1, expected, 0], rtol=1e-9)
    v = answer("dls-variable[isotropic_damping=0.01]", np.diag([1.0, 1e-3, 0.0]), V)
    np.testing.assert_allclose(v, [1 / (1 + 1e-4), 1e-3 / (1e-6 + 1e-4), 0], rtol=1e-9)


# --- parameters


@pytest.mark.parametrize(
    ("selector", "message"),
    [
        ("jacobian-transpose[rank_tolerance=0]", "rank_tolerance=0.0 must be finite and above 0"),
        ("tsvd[relative_tolerance=1]", "relative_tolerance=1.0 must be at least 0 and below 1"),
        ("dls-manipulability[damping=-1]", "damping=-1.0 must be finite and at least 0"),
        ("dls-manipulability[threshold=0]", "threshold=0.0 must be finite and above 0"),
        ("dls-variable[damping=inf]", "damping=inf must be finite and at least 0"),
        (
            "dls-variable[isotropic_damping=-1]",
            "isotropic_damping=-1.0 must be finite and at least 0",
        ),
        ("dls-variable[rank_tolerance=nan]", "rank_tolerance=nan must be finite and at least 0"),
        ("dls-variable[threshold=0]", "threshold=0.0 must be finite and above 0"),
        ("lm[error_factor=-1]", "error_factor=-1.0 must be finite and at least 0"),
        ("lm[damping=nan]", "damping=nan must be finite and at least 0"),
        ("sdls[max_rate=0]", "max_rate=0.0 must be finite and above 0"),
        ("sv-filter[smallest=0]", "smallest=0.0 must be finite and above 0"),
        (
            "sv-filter[smallest=0.01,shape=200]",
            "shape=200.0 must be between smallest=0.01 and 2 / smallest",
        ),
        ("jparse[threshold=1]", "threshold=1.0 must be above 0 and below 1"),
        ("condition-governor[slow=30]", "slow=30.0 must be below stop=30.0"),
        (
            "condition-governor[rank_tolerance=-1]",
            "rank_tolerance=-1.0 must be finite and at least 0",
        ),
    ],
)
def test_parameters_out_of_range_are_errors_of_one_line(selector: str, message: str) -> None:
    """The law, the parameter, and what would be valid."""
    with pytest.raises(
        Exception, match=rf"^formulation {selector.partition('[')[0]}: {message}( \[|$)"
    ):
        make_formulation(selector)
