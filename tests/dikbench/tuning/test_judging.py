"""What is best of what was tried, from rows that nobody ran."""

from __future__ import annotations

from typing import Any

import pandas as pd
import pytest
from makers.rows import make_rows

from dikbench.selector import parse_selector
from dikbench.statistics.mean_success import mean_success
from dikbench.tuning.judging import gain, scores

LAW = parse_selector("dls")
CANDIDATES = [parse_selector(f"dls[damping={value}]") for value in ("0.01", "0.02", "0.03", "0.04")]


def off_path(*distances: float) -> dict[str, Any]:
    """What differs in trials that were at most so far [m] from their paths, one per scenario."""
    return {"contour_error_6d_max_m": list(distances)}


def rows(
    of_laws: dict[str, dict[str, Any]],
    scenarios: tuple[str, ...] = ("reach", "reach[distance=0.2]"),
) -> pd.DataFrame:
    """Make rows with both references, alike."""
    each = [
        make_rows(dict(of_laws.items()), scenarios, reference=name) for name in ("time", "path")
    ]
    return pd.concat(each, ignore_index=True)


def test_success_is_the_mean_over_the_tolerances() -> None:
    """4 mm off the path: outside at 1 and 2 mm, inside at 5, 10 and 20."""
    found = mean_success(rows({"dls": off_path(0.004, 0.0)}), ["dls"]).set_index("scenario")[
        "success"
    ]
    assert found["reach"] == pytest.approx(3 / 5)
    assert found["reach[distance=0.2]"] == 1.0


def test_both_references_count_alike() -> None:
    """What only keeps up where the path may wait succeeds in half."""
    late = make_rows({"dls": off_path(0.5)}, ("reach",), reference="time")
    waiting = make_rows({"dls": off_path(0.0)}, ("reach",), reference="path")
    found = mean_success(pd.concat([late, waiting], ignore_index=True), ["dls"])
    assert list(found["success"]) == [0.5]


def test_a_trial_that_failed_succeeds_nowhere() -> None:
    """It is not left out of the mean, and it is as far away as can be."""
    failed: dict[str, Any] = {
        "status": "diverged",
        "decided_before": "diverged",
        "outcome": "diverged",
    }
    failed |= {"contour_error_6d_max_m": float("nan")}
    found = mean_success(rows({"dls": failed}, ("reach",)), ["dls"])
    assert list(found["success"]) == [0.0]
    assert list(found["log_distance"]) == [0.0]


def test_the_best_has_the_largest_success_then_the_smallest_distance() -> None:
    """A tie in success is decided by the distance from the path; the default takes part."""
    found = scores(
        rows(
            {
                "dls": off_path(0.008, 0.008),
                "dls[damping=0.01]": off_path(0.0015, 0.0018),
                "dls[damping=0.02]": off_path(0.0015, 0.0012),
                "dls[damping=0.03]": off_path(0.05, 0.05),
                "dls[damping=0.04]": off_path(0.003, 0.003),
            }
        ),
        LAW,
        CANDIDATES,
    )
    assert list(found.success) == pytest.approx([0.4, 0.8, 0.8, 0.0, 0.6])
    assert str(found.best) == "dls[damping=0.02]"
    assert str(found.worst) == "dls[damping=0.03]"
    assert found.half_success == pytest.approx(0.8)
    assert found.cases == 2


def test_the_default_stays_where_nothing_is_better() -> None:
    """It wins a tie in both figures, too: nothing is changed for nothing."""
    found = scores(
        rows({str(each): off_path(0.0, 0.0) for each in (LAW, *CANDIDATES)}), LAW, CANDIDATES
    )
    assert found.best == LAW


def test_the_second_half_is_known_by_what_it_adds() -> None:
    """Here the last candidate is the best."""
    far = {str(each): off_path(0.008, 0.008) for each in (LAW, *CANDIDATES)}
    found = scores(rows({**far, "dls[damping=0.04]": off_path(0.0, 0.0)}), LAW, CANDIDATES)
    assert (found.half_success, found.best_success) == pytest.approx((0.4, 1.0))


def test_families_weigh_alike() -> None:
    """Three scenarios of one family count as much as one of another."""
    scenarios = ("reach", "reach[distance=0.2]", "reach[distance=0.3]", "step")
    found = scores(
        rows({str(each): off_path(0.0, 0.0, 0.0, 0.5) for each in (LAW, *CANDIDATES)}, scenarios),
        LAW,
        CANDIDATES,
    )
    assert list(found.success) == pytest.approx([0.5] * 5)


def test_the_gain_is_the_paired_difference_on_other_rows() -> None:
    """In points, tuned less default, within its interval."""
    train = rows(
        {
            "dls": off_path(0.008, 0.008),
            **{str(each): off_path(0.05, 0.05) for each in CANDIDATES[1:]},
            "dls[damping=0.01]": off_path(0.0, 0.0),
        }
    )
    test = rows(
        {
            "dls": off_path(0.004, 0.008),
            "dls[damping=0.01]": off_path(0.0, 0.008),
            "dls[damping=0.02]": off_path(0.05, 0.05),
        }
    )
    found = gain(test, scores(train, LAW, CANDIDATES))
    assert (found.default, found.tuned, found.worst) == pytest.approx((0.5, 0.7, 0.0))
    assert found.difference == pytest.approx(0.2)
    assert found.lower <= 0.2 <= found.upper
    assert found.cases == 2


def test_nobody_gains_by_refusing() -> None:
    """What is skipped succeeds nowhere, also where all refuse it: by the oracle's facts."""
    law = "dls[damping=0.01]"
    skipped = {"status": ["ok", "skipped"], "feasible": ["time", ""], "outcome": ["success", ""]}
    table = rows({"dls": off_path(0.004, 0.004), law: skipped})
    means = mean_success(table, ["dls", law]).groupby("formulation")["success"].mean()
    assert dict(means) == pytest.approx({"dls": 0.6, law: 0.5})
    alone = table[table["formulation"].eq(law)]
    assert len(mean_success(alone, [law])) == 1
    oracle = make_rows({"oracle": {}}, ("reach", "reach[distance=0.2]"))
    known = mean_success(pd.concat([alone, oracle], ignore_index=True), [law])
    assert list(known["success"]) == [1.0, 0.0]


def test_who_crashes_first_is_not_near_the_path() -> None:
    """A tie in success is not won by a run that ended before it could leave the path."""
    crashes = {"status": ["law-error", "ok"], "contour_error_6d_max_m": [0.0, 0.0]}
    far = {str(each): off_path(0.05, 0.0) for each in CANDIDATES}
    table = rows({"dls": off_path(0.06, 0.0), **far, str(CANDIDATES[0]): crashes})
    found = scores(table, LAW, CANDIDATES)
    assert list(found.success) == pytest.approx([0.5] * 5)
    assert found.best == CANDIDATES[1]
    assert found.worst == CANDIDATES[0]


def test_where_nothing_succeeds_the_default_stays() -> None:
    """However near to the path another one comes."""
    far = {str(each): off_path(0.5, 0.5) for each in CANDIDATES}
    found = scores(rows({"dls": off_path(0.9, 0.9), **far}), LAW, CANDIDATES)
    assert found.best == LAW
