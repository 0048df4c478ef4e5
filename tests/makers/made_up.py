"""A study that nobody ran: failures, skips, ties, undefined metrics, two plants, two solvers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import pandas as pd

from makers.recomputed import outcome_at
from makers.rows import FAULTLESS

SCENARIOS: Final[Mapping[str, Mapping[str, Any]]] = {
    **{
        f"line[robot={robot},k={k}]": {"situation": "free space", "robot": robot}
        for robot, k in (("ur5", 1), ("ur5", 2), ("panda", 1))
    },
    **{f"bend[k={k}]": {"situation": "free space", "robot": "iiwa"} for k in (1, 2)},
    **{
        f"fold[robot={robot},k={k}]": {
            "situation": "near singularities", "robot": robot, "feasible": "path",
        }
        for robot, k in (("ur5", 1), ("ur5", 2), ("ur5", 3), ("panda", 1), ("panda", 2))
    },
    **{f"edge[k={k}]": {"situation": "at joint limits", "robot": "iiwa"} for k in (1, 2)},
    **{
        f"wall[k={k}]": {"situation": "obstacles or torques", "robot": "panda"}
        for k in (1, 2, 3, 4, 5)
    },
    **{
        f"step[k={k}]": {"situation": "steps", "robot": "ur5", "judged_by_path": 0.0}
        for k in (1, 2, 3, 4)
    },
    "hold": {"situation": "steps", "robot": "ur5", "judged_by_path": 0.0},
    "far": {"situation": "free space", "robot": "ur5", "feasible": "no"},
    "odd": {"situation": "at joint limits", "robot": "ur5", "feasible": "unknown"},
}  # fmt: skip
"""Scenarios with what differs from one in free space; names are no families of dikbench."""

CONTENDERS: Final = (
    ("good", "none"),
    ("twin", "none"),
    ("slow[gain=0.5]", "none"),
    ("careless", "none"),
    ("crashy", "none"),
    ("fair", "daqp"),
    ("fair", "osqp"),
    ("blind", "none"),
    ("absent", "none"),
    ("oracle", "none"),
)


def made_up_study() -> pd.DataFrame:
    """Make the rows of the study, always the same ones, with the columns of trials.csv."""
    random = np.random.default_rng(7)
    rows: list[dict[str, Any]] = []
    for place, (formulation, solver) in enumerate(CONTENDERS):
        name = formulation.split("[")[0]
        for scenario, facts in SCENARIOS.items():
            at_rest = facts.get("judged_by_path") == 0.0
            for plant in ("ideal", "saturating"):
                for reference in ("time", "path"):
                    for seed in (0, 1):
                        row: dict[str, Any] = {
                            "id": f"{len(rows):016x}", "formulation": formulation,
                            "solver": solver, "scenario": scenario, "plant": plant,
                            "reference": reference, "seed": seed, **FAULTLESS,
                            "tolerance_m": 0.005, **facts,
                        }  # fmt: skip
                        if at_rest and reference == "path":
                            row |= {"status": "skipped", "outcome": ""}
                            row |= dict.fromkeys(("robot", "feasible", "situation"), "")
                            rows.append(row)
                            continue
                        rows.append(_measured(row, name, place, random))
    return pd.DataFrame(rows)


def _measured(
    row: dict[str, Any], name: str, place: int, random: np.random.Generator
) -> dict[str, Any]:
    """Fill in what was measured, and the outcome that follows."""
    size = {"good": 0.3, "twin": 0.3, "slow": 0.3, "careless": 0.1, "fair": 1.0}.get(name, 0.8)
    hard = row["situation"] in ("near singularities", "at joint limits")
    error = 1e-3 * size * (1 + 5 * hard * (name in ("fair", "crashy"))) * random.lognormal(0, 0.5)
    if name == "twin":
        error = 1e-3
    at_rest, scenario = row["judged_by_path"] == 0.0, row["scenario"]
    row |= {
        "contour_error_6d_max_m": error,
        "tracking_error_6d_max_m": (0.0 if scenario == "hold" else 0.3) if at_rest else 3 * error,
        "tracking_error_6d_final_m": error / 2,
        "path_done_99_tolerance_m": np.nan if at_rest else error / 3,
        "path_done_90_tolerance_m": np.nan if at_rest else error / 4,
        "lag_tolerance_m": np.nan if at_rest else error * random.uniform(0.5, 2.0),
        "path_done_share": np.nan if at_rest else 1 - min(error, 0.5),
        "slow_down": np.nan if at_rest else 1.0,
        "position_error_max_m": error,
        "orientation_error_max_rad": np.nan if at_rest else 10 * error,
        "velocity_peak_ratio": 0.5 + 100 * error,
        "position_violation_max_rad": error if name == "careless" else 0.0,
        "torque_usage_max": error if row["situation"] == "obstacles or torques" else np.nan,
        "violating_share": error,
        "chatters": float(name == "fair" and random.random() < 0.2),
        "coped": float(name != "blind") if row["feasible"] == "no" else np.nan,
    }
    if name == "slow" and row["reference"] == "path" and not at_rest:
        row["slow_down"] = 2.0
    if name == "careless" and random.random() < 0.3:
        row |= {"decided_before": "limit-broken", "velocity_peak_ratio": random.uniform(1.0, 1.1)}
    if row["situation"] == "obstacles or torques":
        row["sees_constraints"] = float(name != "blind")
        if name == "blind":
            row |= {"decided_before": "collided", "distance_violation_max_m": 0.02}
    if name not in ("crashy", "oracle"):
        times = 10.0 * (place + 1) * random.lognormal(0, 0.1)
        row |= {
            "formulation_time_median_us": times, "formulation_own_time_median_us": times / 2,
            "solver_core_time_median_us": times / 4, "solver_wrapper_time_median_us": times / 4,
            "formulation_time_p99_us": 2 * times, "formulation_time_p999_us": 3 * times,
            "formulation_time_max_us": 4 * times, "kinematics_time_median_us": 9.0,
            "timing_stability": "drift" if name == "blind" and place % 2 else "stable",
            **{f"missed_{rate}_hz_share": rate / 1e5 for rate in (100, 200, 500, 1000)},
        }  # fmt: skip
    if row["solver"] != "none":
        row |= {
            "claimed_share": 1.0, "verified_share": 0.9, "disagreed_share": 0.1,
            "solver_failed_share": 0.01 * (row["solver"] == "osqp"), "steps": 100 + place,
            "not_verified_share": 0.1, "primal_residual_max_rad_s": error,
            "optimum_distance_max_rad_s": error / 7,
        }  # fmt: skip
    row["outcome"] = outcome_at(row, row["tolerance_m"])
    if name == "crashy" and scenario.startswith(("edge", "step")) and row["seed"]:
        facts = ("robot", "feasible", "situation", "off_path_by")
        row |= {"status": "crashed", "message": "it fell", "steps": 0, "judged_by_path": np.nan}
        row |= dict.fromkeys(facts, "") | {"tolerance_m": np.nan, "velocity_peak_ratio": np.nan}
        row |= {"outcome": "did-not-run", "decided_before": "did-not-run"}
    if name == "absent" and scenario.startswith(("wall", "far")):
        row |= {"status": "skipped", "outcome": "", "decided_before": ""}
    return row
