"""How bad a trial was."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dikbench.advice.badness import (
    BROKEN_RANK,
    DONE_RANK,
    FAILED_RANK,
    Badness,
    badness_of,
    worse_by,
)
from dikbench.metrics import Outcome

BADNESSES = st.builds(Badness, st.integers(0, 2), st.floats(1e-6, 1e6))


def row(outcome: str, **changes: Any) -> dict[str, Any]:
    """Make the row of a trial that followed a path."""
    return {
        "status": "ok",
        "outcome": outcome,
        "feasible": "path",
        "judged_by_path": 1.0,
        "holds": 0.0,
        "contour_error_6d_max_m": 0.01,
        "tracking_error_6d_final_m": 0.02,
        **changes,
    }


def test_every_outcome_has_a_rank() -> None:
    """Done, not done, and stopped: a broken limit, a collision, a run that broke off."""
    ranks = {
        each.value: None if (found := badness_of(row(each.value))) is None else found.rank
        for each in Outcome
        if each is not Outcome.DOES_NOT_SEE
    }
    assert {name for name, rank in ranks.items() if rank == DONE_RANK} == {"success", "recovered"}
    assert {name for name, rank in ranks.items() if rank == BROKEN_RANK} == {
        "limit-broken", "collided", "diverged", "did-not-run",
    }  # fmt: skip
    assert set(ranks.values()) == {DONE_RANK, FAILED_RANK, BROKEN_RANK}


@given(BADNESSES, BADNESSES)
def test_the_numbers_are_in_the_order_of_the_badnesses(first: Badness, second: Badness) -> None:
    """No distance makes up for a rank; within a rank the farther one is worse."""
    if first < second:
        assert first.number <= second.number
        if first.rank < second.rank:
            assert first.number < second.number or second.distance == 1e-6


@given(BADNESSES, BADNESSES)
def test_who_is_worse_is_antisymmetric_and_has_the_sign_of_the_order(
    first: Badness, second: Badness
) -> None:
    """A difference of ranks decides before any of distances."""
    difference = worse_by(first, second)
    assert difference == pytest.approx(-worse_by(second, first))
    if first.rank > second.rank:
        assert difference > 0
    elif first.rank == second.rank and first.distance > 2 * second.distance:
        assert difference > 0


@pytest.mark.parametrize(
    "changes",
    [
        {"feasible": "no"},
        {"feasible": "unknown"},
        {"status": "skipped", "outcome": ""},
        {"status": "skipped", "outcome": "does-not-see"},
        {"status": "timeout", "outcome": "did-not-run"},
        {"status": "out-of-memory", "outcome": "did-not-run"},
    ],
)
def test_what_nothing_can_do_or_the_machine_decides_does_not_count(changes: dict[str, Any]) -> None:
    """However bad it looks."""
    assert badness_of({**row("limit-broken"), **changes}) is None


def test_a_run_without_a_motion_is_infinitely_far() -> None:
    """A crash has neither a distance nor a word on what is feasible, and counts."""
    crashed = {"status": "crashed", "outcome": "did-not-run"}
    assert badness_of(crashed) == Badness(BROKEN_RANK, inf)


def test_a_target_at_rest_is_judged_by_where_the_robot_ends() -> None:
    """On the way to it every robot is far from it, and one that holds still is not."""
    found = badness_of(row("success", judged_by_path=0.0))
    assert found == Badness(DONE_RANK, 0.02)
    assert badness_of(row("success", judged_by_path=0.0, holds=1.0)) == Badness(DONE_RANK, 0.01)
