"""Peers beside our formulations: how far their velocities are apart, and what a tick costs."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import pandas as pd

NOTE: Final = (
    "Each peer is the real library, asked every problem of a run of our formulation. The "
    "difference is the largest of any joint at any step; where it is above 1e-6 rad/s the reasons "
    "stand beside it. Ticks are whole: kinematics, posing and solving, medians over scenarios of "
    "medians, timed in the same rounds; the ratio is ours over the peer's, below 1 where ours is "
    "faster; on scenarios where the times of either are not stable it is rough."
)

AGREEMENT: Final = (
    "formulation",
    "peer",
    "scenario",
    "solver",
    "steps",
    "velocity_difference_max_rad_s",
    "explained_by",
)
COST: Final = (
    "formulation",
    "peer",
    "peer_version",
    "scenario",
    "solver",
    "our_tick_median_us",
    "peer_tick_median_us",
    "ratio",
    "stable",
)

_COUNT: Final = re.compile(r" \(\d+ steps\)")


def peers_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Make a row per peer, our formulation and its solver, over all scenarios.

    Args:
        rows: see `dikbench.results.peers`.
    """
    found = []
    for (peer, formulation, solver), part in _with_ratio(rows).groupby(
        ["peer", "formulation", "solver"], sort=False
    ):
        reasons = _COUNT.sub("", "; ".join(filter(None, part["explained_by"]))).split("; ")
        found.append(
            {
                "peer": peer,
                "version": ", ".join(dict.fromkeys(part["peer_version"])),
                "ours": formulation,
                "solver": solver,
                "scenarios": len(part),
                "steps": int(part["steps"].sum()),
                "largest difference [rad/s]": part["velocity_difference_max_rad_s"].max(),
                "why": "; ".join(dict.fromkeys(filter(None, reasons))),
                "our tick [us]": part["our_tick_median_us"].median(),
                "its tick [us]": part["peer_tick_median_us"].median(),
                "ratio": part["ratio"].median(),
                "stable": f"{int(part['ticks_stable'].sum())} of {part['ratio'].notna().sum()}",
            }
        )
    return pd.DataFrame(found)


def write_peers_tables(rows: pd.DataFrame, folder: Path) -> None:
    """Write peer_agreement.csv and peer_cost.csv, if there are rows."""
    if rows.empty:
        return
    folder.mkdir(exist_ok=True)
    told = _with_ratio(rows).astype({"steps": int})
    told[list(AGREEMENT)].to_csv(folder / "peer_agreement.csv", index=False)
    timed = told[told["ratio"].notna()]
    timed = timed.assign(stable=timed["ticks_stable"].map({1.0: "yes", 0.0: "no"}))
    timed[list(COST)].to_csv(folder / "peer_cost.csv", index=False, float_format="%.4g")


def _with_ratio(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(ratio=rows["our_tick_median_us"] / rows["peer_tick_median_us"])
