"""Whether the order of formulations hangs on a parameter that all scenarios have."""

import numpy as np
import pandas as pd
import pytest

from dikbench.statistics.rank_agreement import rank_agreement

LAWS = "abcd"


def study(done: dict[str, dict[str, int]], scenarios: int = 8) -> pd.DataFrame:
    """Make rows: of each law, at each value of a parameter, so many scenarios done."""
    return pd.DataFrame(
        [
            {
                "scenario": f"reach[distance={number}{value and f',{value}'}]",
                "scenario_family": "reach",
                "robot": "panda",
                "seed": 0,
                "formulation": law,
                "solver": "none",
                "plant": "ideal",
                "reference": "time",
                "outcome": "success" if number < count else "late",
            }
            for value, counts in done.items()
            for law, count in counts.items()
            for number in range(scenarios)
        ]
    )


def test_the_same_order_agrees_and_the_reverse_does_not() -> None:
    """Kendall's tau is 1 and -1 where there are no ties."""
    up, down = (
        dict(zip(LAWS, (1, 3, 5, 7), strict=True)),
        dict(zip(LAWS, (7, 5, 3, 1), strict=True)),
    )
    found = rank_agreement(
        study({"": up, "characteristic_length=0.1": up, "characteristic_length=0.5": down})
    )
    assert found["value"].tolist() == ["0.1", "0.5"]
    assert found["against"].tolist() == ["default"] * 2
    assert found["kendall"].tolist() == pytest.approx([1.0, -1.0])
    assert found["largest_change"].tolist() == pytest.approx([0.0, 6 / 8])
    assert found["scenarios"].tolist() == [8, 8]


def test_by_hand_with_ties() -> None:
    """Of 6 pairs one is tied in one order, and one reversed: tau-b = (4 - 1) / sqrt(5 6)."""
    found = rank_agreement(
        study(
            {
                "dt=0.01": dict(zip(LAWS, (2, 2, 4, 6), strict=True)),
                "dt=0.02": dict(zip(LAWS, (1, 2, 4, 3), strict=True)),
            }
        )
    )
    (row,) = found.to_dict("records")
    assert (row["parameter"], row["against"], row["value"]) == ("dt", "0.02", "0.01")
    # pairs of b: ab +, ac +, ad +, bc +, bd +, cd -; in a ab is tied: 4 agree, 1 does not.
    assert row["kendall"] == pytest.approx((4 - 1) / np.sqrt(5 * 6))


def test_scenarios_that_did_not_run_at_every_value_do_not_count() -> None:
    """Nor formulations; and where nothing differs nothing is said."""
    rows = study({"": {"a": 1, "b": 3}, "gain=2": {"a": 1, "b": 3, "c": 2}})
    assert rank_agreement(rows[rows["scenario"].ne("reach[distance=7,gain=2]")])[
        ["scenarios", "formulations"]
    ].to_numpy().tolist() == [[7, 2]]
    assert rank_agreement(study({"": {"a": 1, "b": 3}})).empty
