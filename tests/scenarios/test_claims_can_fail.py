"""Every claim of every family has a bound, and a blunted scenario that misses it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from makers.scenarios import CLOSED

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.problem.constraints import CollisionConstraint
from dikbench.scenario import OracleMotion, oracle
from scenarios import SCENARIOS

Mutant = Callable[[OracleMotion], OracleMotion]

OTHER_MOTIONS: Mapping[str, Mutant] = {
    "near a singularity": lambda m: replace(m, sigma_min=0.01 * m.sigma_min),
    "far from any": lambda m: replace(m, sigma_min=1.0 + 0 * m.sigma_min),
    "outside a limit": lambda m: replace(m, margin=m.margin - 4.0),
    "away from limits": lambda m: replace(m, margin=m.margin + 4.0),
    "fast": lambda m: replace(m, v=100 * m.v, speed_ratio=100 * m.speed_ratio),
    "slow": lambda m: replace(m, v=m.v / 10, speed_ratio=m.speed_ratio / 10),
    "not towards the inside": lambda m: replace(m, margin=m.margin[0] + 0 * m.margin),
    "half as far": lambda m: replace(m, q=m.q[0] + (m.q - m.q[0]) / 2, reach=m.reach / 2),
    "nearest at its end": lambda m: replace(
        m, sigma_min=np.linspace(m.sigma_min.max(), m.sigma_min.min(), len(m.sigma_min))
    ),
}
"""How a motion may be measured that is not what the family claims of it."""

VARIANTS: Mapping[str, tuple[str, ...]] = {
    "near-miss": ("", "miss=0", "robot=panda"),
    "obstacle": ("", "where=elbow"),
    "hold-still": ("", "posture=limit", "posture=singular"),
    "speed-sweep": ("dt=0.05",),
    "pick-and-place": ("dt=0.05",),
    "hexagon": ("dt=0.01",),
}
"""Parameters with other claims than the defaults, or with the same ones after fewer samples."""

ELSEWHERE: Mapping[str, set[str]] = {
    "joint-limit-crossing": {"its share in the least-norm motion"},
    "joint-limit-approach": {
        "room before the limit over the braking distance",
        "its share in the least-norm motion",
    },
    "start-outside": {"its share in the least-norm motion"},
    "obstacle": {"least distance of another motion that does it [m]"},
    "greedy-trap": {"end of the shortest way, past a limit at 0 [rad]"},
    "log-derivative-drift": {
        "length of the screw over the distance",
        "yaw between the poses [rad]",
    },
    "workspace-boundary": {"farthest target over the reach"},
    "torque-limited": {"torque of the motion over limit", "torque to hold it over limit"},
    "back-and-forth": {"sweep from end to end [m]"},
    "task-conflict": {"smallest singular value of J_2 N_1 half way (m)"},
    "humanoid": {
        "way that the feet move (m, rad)",
        "room of the centre of mass above the feet [m]",
    },
}
"""Claims whose blunted scenarios are in the tests of their families."""


SLOW = ("humanoid", "obstacle")
"""Families that take long to make many times."""


def _selectors(name: str) -> list[str]:
    return [f"{name}[{given}]" if given else name for given in VARIANTS.get(name, ("",))]


def _blunted(name: str, patch: pytest.MonkeyPatch) -> Iterator[None]:
    """Blunt a family in one way after another."""
    module, measure = sys.modules[SCENARIOS[name].__module__], oracle.measure_motion
    distances: Any = CollisionConstraint.distances

    def put(owner: object, attribute: str, value: object) -> Iterator[None]:
        with patch.context() as context:
            context.setattr(owner, attribute, value)
            yield

    for change in OTHER_MOTIONS.values():
        with patch.context() as context:

            def measured(*given: Any, change: Mutant = change, **named: Any) -> OracleMotion:
                return change(measure(*given, **named))

            context.setattr(oracle, "measure_motion", measured)
            if hasattr(module, "measure_motion"):
                context.setattr(module, "measure_motion", measured)
            yield
    if hasattr(module, "duration_at"):
        duration = module.duration_at
        for share in (2.0, 0.2):
            yield from put(
                module, "duration_at", lambda *given, share=share: share * duration(*given)
            )
    if name == "humanoid":
        lap = module.oracle_motion
        yield from put(module, "oracle_motion", lambda *given: OTHER_MOTIONS["fast"](lap(*given)))
    for off in (-0.2, 0.2):
        yield from put(
            CollisionConstraint, "distances", lambda *given, off=off: distances(*given) + off
        )
    for helper, value in (
        ("_conflict", (1.0, 0.0, 0.0)),
        ("_measured", (0.0, 1.0, 0.0)),
        ("_heaviest", 0.01),
        ("_distance_of_hand", 0.0),
        ("_distance_from", 1.0),
        ("_length", 0.0),
    ):
        if hasattr(module, helper) and name != "joint-limit-detour":
            yield from put(module, helper, lambda *given, value=value: value)


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.long if n in SLOW else ()) for n in CLOSED],
)
def test_every_claim_can_fail(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """For each there is a blunted scenario whose certificate names it, here or in a test of its."""
    selectors = _selectors(name)
    claims = [claim for each in selectors for claim in make_scenario(each).certificate.claims]
    assert all(np.isfinite(claim.at_least) or np.isfinite(claim.at_most) for claim in claims)
    missing = {claim.quantity for claim in claims} - ELSEWHERE.get(name, set())
    for _ in _blunted(name, monkeypatch):
        for each in selectors if missing else ():
            try:
                make_scenario(each)
            except DikbenchError as error:
                missing = {quantity for quantity in missing if f"{quantity} = " not in str(error)}
    assert not missing
