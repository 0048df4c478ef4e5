"""Straw laws change no conclusion, whatever the others achieve."""

from __future__ import annotations

from collections.abc import Callable

import pandas as pd
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from makers.rows import Values, make_rows

from dikbench.report.conclusions import conclusions

CASES = {
    **{f"line[k={k}]": "free space" for k in (1, 2, 3)}, "bend[k=1]": "free space",
    "bend[k=2]": "free space", **{f"fold[k={k}]": "near singularities" for k in (1, 2, 3, 4)},
    "turn[k=1]": "near singularities", "edge[k=1]": "at joint limits",
    **{f"wall[k={k}]": "obstacles or torques" for k in (1, 2, 3, 4, 5)},
    **{f"step[k={k}]": "steps" for k in (1, 2, 3, 4)}, "hold": "steps",
}  # fmt: skip
AT_REST = ("step[k=1]", "step[k=2]", "step[k=3]", "step[k=4]", "hold")
OUTCOMES = st.sampled_from(["success", "success", "success", "left-path", "late", "limit-broken"])


def _straw(outcome: Callable[[str], str], error: Callable[[str], float]) -> dict[str, list[object]]:
    return {
        "outcome": [outcome(scenario) for scenario in CASES],
        "tracking_error_6d_max_m": [error(scenario) for scenario in CASES],
        "slow_down": [0.5 for _ in CASES],
        "contour_error_6d_max_m": [0.0 for _ in CASES],
        "sees_constraints": [0.0 if s.startswith("wall") else float("nan") for s in CASES],
    }


def _at_start(scenario: str) -> float:
    return 0.0 if scenario == "hold" else 0.3


STRAWS = {
    "Idle": _straw(lambda s: "success" if s == "hold" else "unfinished", _at_start),
    "Creeper": _straw(lambda s: "success" if s == "hold" else "late", _at_start),
    "Reckless": _straw(
        lambda s: "success" if CASES[s] in ("free space", "steps") else "limit-broken", _at_start
    ),
    "Jittery": _straw(lambda s: "chattering" if s != "line[k=1]" else "limit-broken", _at_start),
}


@settings(
    max_examples=4,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.generate],
)
@given(
    outcomes=st.lists(
        st.lists(OUTCOMES, min_size=len(CASES), max_size=len(CASES)), min_size=2, max_size=4
    ),
    first=st.booleans(),
    which=st.sets(st.sampled_from(sorted(STRAWS)), min_size=1),
    setting=st.sampled_from(["path", "time"]),
)
def test_straw_laws_change_no_conclusion(
    outcomes: list[list[str]], first: bool, which: set[str], setting: str
) -> None:
    """Whatever the others achieve, and in whichever order they stand: no sentence, no star."""
    values: dict[str | tuple[str, str], Values] = {
        f"f{place}": {
            "outcome": list(of),
            "tracking_error_6d_max_m": [_at_start(s) for s in CASES],
            "contour_error_6d_max_m": 1e-3 * (place + 1),
        }
        for place, of in enumerate(outcomes)
    }

    def made(of: dict[str | tuple[str, str], Values]) -> pd.DataFrame:
        rows = make_rows(of, list(CASES), seeds=(0, 1), reference=setting)
        rows["situation"] = rows["scenario"].map(CASES)
        at_rest = rows["scenario"].isin(AT_REST)
        rows["judged_by_path"] = 1.0 - at_rest
        rows.loc[at_rest, "reference"] = "time"
        return rows

    honest = made(values)
    straws = made({f"straw.py:{name}": STRAWS[name] for name in sorted(which)})
    together = pd.concat([straws, honest] if first else [honest, straws], ignore_index=True)
    assert conclusions(together) == conclusions(honest)


def test_the_property_would_notice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the bound on broken limits a reckless law is named."""
    from dikbench.statistics import first_places

    rows = make_rows(
        {"a": {"outcome": "late"}, "Reckless": STRAWS["Reckless"]}, list(CASES), reference="path"
    )
    rows["situation"] = rows["scenario"].map(CASES)
    assert not any("Reckless" in line for line in conclusions(rows))
    monkeypatch.setattr(first_places, "MOST_BROKEN_SHARE", 1.0)
    assert any("Reckless" in line for line in conclusions(rows))
