"""How often a solver's return code was right: what it claimed against what the recheck found."""

from __future__ import annotations

import pandas as pd

TITLE = "How often the return code was right, over all steps at which something was solved"


def return_codes(trials: pd.DataFrame) -> pd.DataFrame:
    """Claimed, verified and right per solver, in shares of the steps.

    A return code is right where it claims what the recheck verifies, or claims nothing where there
    is nothing to verify: an honest failure.

    Args:
        trials: the rows of trials.csv.
    """
    asked = trials[trials["claimed_share"].notna()]
    shares = asked[["claimed_share", "verified_share", "disagreed_share"]]
    sums = shares.mul(asked["steps"], axis=0).assign(steps=asked["steps"], solver=asked["solver"])
    found = sums.groupby("solver", sort=False).sum()
    return pd.DataFrame(
        {
            "solver": found.index,
            "steps": found["steps"].astype(int).to_numpy(),
            "claimed": (found["claimed_share"] / found["steps"]).to_numpy(),
            "verified": (found["verified_share"] / found["steps"]).to_numpy(),
            "return code right": (1 - found["disagreed_share"] / found["steps"]).to_numpy(),
        }
    )
