"""What selectors name stands in columns of its own."""

from __future__ import annotations

from pathlib import Path

import dikbench


def test_selectors_are_split_into_columns(committed: Path) -> None:
    """Names and parameters stand beside the selectors; numbers are numbers, the rest is missing."""
    trials = dikbench.load_results(committed).trials
    assert set(trials["formulation_name"]) == {"dls", "lp-alpha"}
    damping = trials.set_index("formulation")["formulation_damping"]
    assert set(damping.loc["dls[damping=1e-1]"]) == {0.1}
    assert damping.loc["lp-alpha"].isna().all()
    assert trials.query("scenario_robot == 'planar3r'")["scenario"].nunique() == 1
    assert set(trials["scenario_family"]) == {"reach"}
    assert set(trials["plant_delay"]) == {2}
    assert set(trials["solver_name"]) == {"none", "proxqp"}
