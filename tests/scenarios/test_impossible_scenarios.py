"""Scenarios that are not what they say are errors of one line."""

from __future__ import annotations

import pytest
from makers.scenarios import CLOSED, error_of, put_robot
from makers.urdfs import DATA

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_family, make_scenario
from dikbench.robots.loading import load_robot
from dikbench.scenario.certificate import Certificate, Claim


@pytest.mark.parametrize(
    ("selector", "parts"),
    [
        (
            "near-miss[miss=0.5]",
            ["scenario near-miss: miss=0.5 must be 0 or 0.001 to 0.2"],
        ),
        ("near-miss[miss=-0.01]", ["miss=-0.01 must be 0 or 0.001"]),
        ("near-miss[miss=nan]", ["miss=nan must be 0 or 0.001"]),
        ("near-miss[speed=0]", ["speed=0.0 must be 0.02 to 3"]),
        ("near-miss[dt=-0.01]", ["dt=-0.01 must be finite and above 0"]),
        ("speed-sweep[radius=0.5]", ["radius=0.5 must be 0.02 to 0.15"]),
        ("joint-limit-crossing[depth=0]", ["depth=0.0 must be 0.02 to 0.5"]),
        ("joint-limit-crossing[approach=1e9]", ["joint-limit-crossing", "approach=1"]),
        ("reach[distance=1]", ["distance=1.0 must be 0.01 to 0.3"]),
        # A claim that does not hold: too fast for the arm.
        (
            "reach[gain=20]",
            ["certificate of 'reach[gain=20]' failed: ", "required speed over limit"],
        ),
        ("reach[robot=panda,frame=nowhere]", ["unknown frame 'nowhere'", "panda_hand"]),
    ],
)
def test_impossible_scenarios_are_errors_of_one_line(selector: str, parts: list[str]) -> None:
    """The parameter and its range, or the claim that is false."""
    with pytest.raises(DikbenchError) as caught:
        make_scenario(selector)
    message = str(caught.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


def test_a_limit_that_cannot_be_reached_fails_loudly(monkeypatch: pytest.MonkeyPatch) -> None:
    """A joint that starts with no room before its limit, or a robot without limits: one line."""
    position = load_robot("ur5").limits.position
    assert position is not None
    # The shoulder of the posture would start beyond its limit: the certificate says so.
    upper = position.upper.copy()
    upper[1] = -1.3
    narrow = load_robot("ur5").with_limits(position=(position.lower, upper))
    for robot, words in (
        (narrow, "position margin at the start"),
        (load_robot("ur5").with_limits(position=None), "robot ur5 has no position limits"),
    ):
        put_robot(monkeypatch, robot)
        with pytest.raises(DikbenchError, match=words) as caught:
            make_scenario("joint-limit-crossing")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", CLOSED)
def test_a_negative_seed_is_an_error(name: str) -> None:
    """Random generators take none."""
    with pytest.raises(DikbenchError, match="seed -1 must not be negative"):
        make_scenario(name, -1)


@pytest.mark.parametrize(
    ("claim", "holds", "text"),
    [
        (Claim("x", 1.0, at_least=0.5), True, "0.5 <= x = 1"),
        (Claim("x", 0.4, at_least=0.5), False, "0.5 <= x = 0.4"),
        (Claim("x", 2.0, at_most=1.5), False, "x = 2 <= 1.5"),
        (Claim("x", 1.0, 0.5, 1.5), True, "0.5 <= x = 1 <= 1.5"),
        (Claim("x", float("nan")), False, "x = nan"),
    ],
)
def test_claims(claim: Claim, holds: bool, text: str) -> None:
    """A value in its range holds; NaN is in none; the words show all three."""
    assert claim.holds == holds
    assert str(claim) == text
    certificate = Certificate((Claim("y", 1.0), claim))
    if holds:
        certificate.check("x")
        return
    with pytest.raises(DikbenchError, match=r"^certificate of 'x' failed: ") as e:
        certificate.check("x")
    assert str(e.value).endswith(f"failed: {claim.failure}")


def test_a_broken_certificate_stops_the_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    """The registry asserts it: nobody can run a scenario that tests something else."""

    def holds(self: Claim) -> bool:
        return False

    monkeypatch.setattr(Claim, "holds", property(holds))
    for name in CLOSED:
        with pytest.raises(DikbenchError, match=r"^certificate of .* failed: "):
            make_scenario(name)


@pytest.mark.parametrize(
    ("selector", "names"),
    [
        ("pick-and-place[robot=tiago,width=0.4,height=0.15,turn=1.5]", ("width", "height", "turn")),
        (f"workspace-boundary[robot={DATA}/limits_above_pi.urdf,frame=tool]", ("frame", "rows")),
    ],
)
def test_what_cannot_be_done_names_what_to_change(selector: str, names: tuple[str, ...]) -> None:
    """Parameters that the family has."""
    said = error_of(make_scenario, selector)
    family = make_family(selector)
    for name in names:
        assert f"{name}=" in said.rpartition("(")[2]
        assert hasattr(family, name)
