"""What is found about other libraries: the protocols, against what must come out of them."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from dikbench.errors import DikbenchError
from dikbench.published.gap import Gap
from dikbench.published.leaking import Leak
from dikbench.published.one_answer import answering
from dikbench.published.outside import Outside
from dikbench.published.small_angles import SmallAngles
from dikbench.published.stopping_early import StoppingEarly

WITHOUT_MINK = pytest.mark.skipif(find_spec("mink") is None, reason="mink is not installed")


def test_two_stages_lose_nothing_and_one_the_more_the_larger_its_gain() -> None:
    """The linear program itself loses nothing either."""
    rules = Leak(count=30)
    lp = Leak(count=30, posture=False).measure("lp-alpha")
    assert lp["most"].value == lp["losing"].value == 0
    assert rules.measure("alpha-two-stage")["most"].value < 1e-3
    leaking = [rules.measure(f"drake[centering={gain}]") for gain in (1, 10)]
    less, more = (each["mean"].value for each in leaking)
    assert 0 < less < more


def test_a_state_without_an_answer_loses_all() -> None:
    """Drake's program outside its limits has none where the null space is empty."""
    found = Outside(robot="ur5", outside=0.01, count=10, posture=False).measure("drake")
    assert found["unanswered"].value == 100
    assert found["fastest"].value == 0


@pytest.mark.parametrize("outside", [0.005, 0.05])
def test_the_way_back_is_within_the_velocity_limits(outside: float) -> None:
    """Of Pink's program here; the pseudo-inverse of a task at rest does not go back."""
    found = Outside(outside=outside, count=20).measure("pink-qp")
    assert found["unanswered"].value == 0
    assert found["back"].value == 100
    assert found["fastest"].value <= 1 + 1e-6
    still = Outside(outside=outside, count=20, posture=False).measure("pinv")
    assert still["back"].value == 0
    assert still["fastest"].value < 1e-9


@WITHOUT_MINK
@pytest.mark.parametrize("outside", [0.005, 0.05])
def test_minks_way_back_is_nineteen_twentieths_in_one_step(outside: float) -> None:
    """At least, in units of the fastest joint's limit; with velocity limits only while it fits."""
    found = Outside(outside=outside, count=10).measure("peer-mink")
    assert found["back"].value == 100
    assert found["fastest"].value > 0.95 * outside / 0.01 / 2.61
    bounded = Outside(outside=outside, count=10).measure("peer-mink[limits=ours]")
    assert bounded["unanswered"].value == (100 if 0.95 * outside / 0.01 > 2.61 else 0)


def test_an_exact_solver_is_at_the_optimum_and_moves_more_the_nearer() -> None:
    """Its own answer; the lost direction needs a speed that grows as the distance falls."""
    far, near = (
        StoppingEarly(distance=distance, count=20).measure("qp-velocity")
        for distance in (0.3, 0.01)
    )
    assert far["most"].value == near["most"].value == 0
    assert far["fastest"].value < 0.5 < near["fastest"].value
    early = StoppingEarly(distance=0.01, count=20, solver="osqp").measure("qp-velocity")
    assert early["mean"].value > 1
    assert early["fastest"].value < 0.5


def test_a_program_does_not_differ_from_itself_at_any_angle() -> None:
    """mink's, which is what others are compared with; one without the derivative does."""
    for angle in (0.0, 1e-3):
        assert SmallAngles(angle=angle, count=10).measure("mink-qp")["most"].value == 0
    without = SmallAngles(count=10).measure("qp-velocity")
    assert without["mean"].value > 1e-3


@pytest.mark.parametrize("limited", [True, False])
def test_our_rows_keep_the_margin(limited: bool) -> None:
    """The gap is 5 cm: at 2 m/s and 10 ms 3 cm are left, without limits what is to be kept."""
    found = Gap("ours", limited=limited, steps=8).measure("qp")
    assert found["first"].value == pytest.approx(0.03 if limited else 0.005, abs=1e-6)
    assert found["least"].value == pytest.approx(0.005, abs=1e-6)


@WITHOUT_MINK
@pytest.mark.parametrize(
    ("gain", "dt", "first"),
    [
        (0.85, 0.01, 0.05 - 0.15),  # all of the way, since 0.85 x 4.5 cm/dt is 3.8 m
        (0.85 * 0.01, 0.01, 0.05 - 0.85 * 0.045),
        (0.85, 1.0, 0.05 - 0.85 * 0.045),
    ],
)
def test_minks_rows_allow_the_gain_times_the_distance_over_the_period(
    gain: float, dt: float, first: float
) -> None:
    """As a displacement, in closed form; right where dt is 1 s."""
    found = Gap("mink", gain=gain, dt=dt, steps=3).measure("peer-mink")
    assert found["first"].value == pytest.approx(first, abs=1e-6)
    assert (found["least"].value < 0) == (first < 0)


def test_a_peer_that_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the command that installs it."""
    monkeypatch.setattr("dikbench.problem.problem.find_spec", lambda name: None)
    with pytest.raises(DikbenchError, match=r"mink is not installed: pip install"):
        answering("peer-mink")
    monkeypatch.setattr(
        "dikbench.published.gap.importlib.import_module", lambda name: exec("raise ImportError")
    )
    with pytest.raises(DikbenchError, match=r"mink is not installed: pip install"):
        Gap("mink").measure("peer-mink")


def test_another_solver_is_asked_where_one_is_named() -> None:
    """And refused where there is none of its name."""
    with pytest.raises(DikbenchError, match="no-such-solver"):
        answering("qp", "no-such-solver")
    assert np.isfinite(StoppingEarly(count=1, solver="clarabel").measure("qp")["mean"].value)
